// Rotors side by side disturb each other's inflow at the tips and recirculate part of their wakes: in hover each thrusts less than
// alone, T (1 - loss f). Edgewise flight carries the wakes away, f = 1 / (1 + (V / v_i)^2). Torque and in-plane force stay.
// A few per cent at hub distances below 3 R (2.8 R here). Source: Lei & Wang 2020; Shukla & Komerath 2018.
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/rotor/wake.hpp"

namespace rotorloop::sim {
namespace {

class HoverInterference final : public Effect {
 public:
  explicit HoverInterference(const EffectValues& v) : loss_(v[0]) {}
  void rotor_loads(const RotorSite& s, RotorLoads& loads) override { loads.force_R_N.z() *= 1.0 - loss_ * wake_below(s); }

 private:
  double loss_;
};

}  // namespace

const EffectInfo kHoverInterference{
    .id = "hover_interference", .parameter = {"loss", "1", 0.0, 0.1, 0.0}, .options = {}, .make = make_effect<HoverInterference>};

}  // namespace rotorloop::sim
