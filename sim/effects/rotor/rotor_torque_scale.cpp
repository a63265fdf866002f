// One rotor takes more (or less) torque than the others for the same thrust: a rough or dirty blade, a bent tip. The shaft needs
// the torque and the body feels its reaction, both times 1 + epsilon. Source: profile drag of a blade element.
#include "sim/effects/rotor/one_rotor.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

void rotor_torque_scale(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  const double epsilon = v[0], rotor = v[1];
  if (is_rotor(s, rotor)) scale_torque(loads, 1.0 + epsilon);
}

constexpr EffectOption kRotorTorqueScaleOptions[] = {kRotorNumber};

}  // namespace

const EffectInfo kRotorTorqueScale{.id = "rotor_torque_scale",
                                   .parameter = {"epsilon", "1", -0.3, 0.3, 0.0},
                                   .options = kRotorTorqueScaleOptions,
                                   .make = effect_of<rotor_torque_scale>};

}  // namespace rotorloop::sim
