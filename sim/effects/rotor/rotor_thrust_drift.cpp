// One rotor loses thrust at the same speed as the flight goes on: a propeller that works loose, a blade that splits. Its torque stays.
// Source: definition.
#include <algorithm>

#include "sim/effects/rotor/one_rotor.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

void rotor_thrust_drift(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  if (is_rotor(s, v[1])) loads.force_R_N.z() *= std::max(0.0, 1.0 + v[0] * s.body->time_s);
}

constexpr EffectOption kRotorThrustDriftOptions[] = {kRotorNumber};

}  // namespace

const EffectInfo kRotorThrustDrift{.id = "rotor_thrust_drift",
                                   .parameter = {"rate_1_s", "1/s", -0.02, 0.02, 0.0},
                                   .options = kRotorThrustDriftOptions,
                                   .make = effect_of<rotor_thrust_drift>};

}  // namespace rotorloop::sim
