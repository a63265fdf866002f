// All rotors lose thrust at the same speed as the flight goes on: ice or dirt that grows on the blades. Torque stays, and the thrust never
// turns round. Source: definition.
#include <algorithm>

#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

void thrust_drift(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  loads.force_R_N.z() *= std::max(0.0, 1.0 + v[0] * s.body->time_s);
}

}  // namespace

const EffectInfo kThrustDrift{
    .id = "thrust_drift", .parameter = {"rate_1_s", "1/s", -0.02, 0.02, 0.0}, .options = {}, .make = effect_of<thrust_drift>};

}  // namespace rotorloop::sim
