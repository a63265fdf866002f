// Edgewise flow loads the advancing blade more than the retreating one and leaves a force in the disk plane against the motion.
// The blade-element model of an isolated rotor has it; share scales it. Thrust and torque stay. On the vehicle the force is
// larger still: rotor_body_interference multiplies the same force, and the plant uses the product of both.
// Source: Mahony, Kumar, Corke 2012; Bangura 2016; paper eq. (4).
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

void rotor_drag(const EffectValues& v, const RotorSite&, RotorLoads& loads) {
  const double share = v[0];
  loads.force_R_N.x() *= share;
  loads.force_R_N.y() *= share;
}

}  // namespace

const EffectInfo kRotorDrag{.id = "rotor_drag", .parameter = {"share", "1", 0.0, 2.0, 1.0}, .options = {}, .make = effect_of<rotor_drag>};

}  // namespace rotorloop::sim
