// Edgewise flow loads the advancing blade more than the retreating one and leaves a force in the disk plane against the motion.
// The blade-element solve of an isolated rotor has it; share scales it. Thrust and torque stay. On the vehicle the force is
// larger still: rotor_body_interference multiplies the same force, and the plant uses the product of both.
// Source: Mahony, Kumar, Corke 2012; Bangura 2016; paper eq. (4).
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class RotorDrag final : public Effect {
 public:
  explicit RotorDrag(const EffectValues& v) : share_(v[0]) {}
  void rotor_loads(const RotorSite&, RotorLoads& loads) override {
    loads.force_R_N.x() *= share_;
    loads.force_R_N.y() *= share_;
  }

 private:
  double share_;
};

}  // namespace

const EffectInfo kRotorDrag{.id = "rotor_drag", .parameter = {"share", "1", 0.0, 2.0, 1.0}, .options = {}, .make = make_effect<RotorDrag>};

}  // namespace rotorloop::sim
