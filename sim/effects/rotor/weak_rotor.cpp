// One rotor gives less (or more) thrust than the others at the same speed: a chipped blade loses about 4 %, a blade of another
// batch a few. From `from_s` on, so that a flight can be broken half way. `torque_share` says how far the torque goes with it: a
// blade of less pitch or span takes less torque (share near 1), one with a bad surface or a blocked wake does not (0).
// Source: blade-element theory, thrust in proportion to blade area and lift coefficient.
#include "sim/effects/rotor/one_rotor.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

void weak_rotor(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  const double epsilon = v[0], rotor = v[1], from_s = v[2], torque_share = v[3];
  if (!is_rotor(s, rotor) || s.body->time_s < from_s) return;
  loads.force_R_N.z() *= 1.0 + epsilon;
  scale_torque(loads, 1.0 + torque_share * epsilon);
}

constexpr EffectOption kWeakRotorOptions[] = {kRotorNumber, {"from_s", "s", 0.0, 1e4, 0.0}, {"torque_share", "1", 0.0, 1.0, 0.0}};

}  // namespace

const EffectInfo kWeakRotor{
    .id = "weak_rotor", .parameter = {"epsilon", "1", -0.5, 0.1, 0.0}, .options = kWeakRotorOptions, .make = effect_of<weak_rotor>};

}  // namespace rotorloop::sim
