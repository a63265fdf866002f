// Rotors side by side disturb each other's inflow at the tips and recirculate part of their wakes: in hover each thrusts less than
// alone, T (1 - loss f). Edgewise flight carries the wakes away, f = 1 / (1 + (V / v_i)^2). Torque and in-plane force stay.
// A few per cent at hub distances below 3 R (2.8 R here). Source: Lei & Wang 2020; Shukla & Komerath 2018.
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/rotor/wake.hpp"

namespace rotorloop::sim {
namespace {

void hover_interference(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  const double loss = v[0];
  loads.force_R_N.z() *= 1.0 - loss * wake_below(s);
}

}  // namespace

const EffectInfo kHoverInterference{
    .id = "hover_interference", .parameter = {"loss", "1", 0.0, 0.1, 0.0}, .options = {}, .make = effect_of<hover_interference>};

}  // namespace rotorloop::sim
