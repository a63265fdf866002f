// Edgewise flow carries more air through the disk, so the same thrust needs less induced velocity and the same rotor speed gives
// more thrust: 12 % more at 8.5 m/s here. The blade-element model has it; share 0 takes the thrust of the same rotor without
// edgewise velocity instead. In-plane force and torque stay.
// Source: Glauert 1926; Hoffmann, Huang, Waslander, Tomlin 2007.
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/rotor/what_if.hpp"

namespace rotorloop::sim {
namespace {

class TranslationalLift final : public Effect {
 public:
  explicit TranslationalLift(const EffectValues& v) : share_(v[0]) {}
  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    if (share_ == 1.0) return;
    RotorCondition axial = s.condition;
    axial.v_R_m_s.x() = axial.v_R_m_s.y() = 0.0;
    loads.force_R_N.z() += (1.0 - share_) * (what_if_(s, axial).force_R_N.z() - s.bare.force_R_N.z());
  }

 private:
  double share_;
  WhatIf what_if_;
};

}  // namespace

const EffectInfo kTranslationalLift{
    .id = "translational_lift", .parameter = {"share", "1", 0.0, 1.0, 1.0}, .options = {}, .make = make_effect<TranslationalLift>};

}  // namespace rotorloop::sim
