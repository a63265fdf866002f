// One rotor takes more (or less) torque than its twins for the same thrust: a rough or dirty blade, a bent tip. The shaft needs
// the torque and the body feels its reaction, both times 1 + epsilon. Source: profile drag of a blade element.
#include "sim/effects/rotor/one_rotor.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class RotorTorqueScale final : public Effect {
 public:
  explicit RotorTorqueScale(const EffectValues& v) : epsilon_(v[0]), rotor_(v[1]) {}
  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    if (is_rotor(s, rotor_)) scale_torque(loads, 1.0 + epsilon_);
  }

 private:
  double epsilon_, rotor_;
};

constexpr EffectOption kOptions[] = {kRotorNumber};

}  // namespace

const EffectInfo kRotorTorqueScale{
    .id = "rotor_torque_scale", .parameter = {"epsilon", "1", -0.3, 0.3, 0.0}, .options = kOptions, .make = make_effect<RotorTorqueScale>};

}  // namespace rotorloop::sim
