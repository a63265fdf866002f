// Moving through the air changes the torque of a rotor, not only its thrust: profile drag rises with edgewise speed, induced
// power falls, climb has to be paid for. The blade-element model has all of it; share 0 takes the torque of the same rotor at
// the same speed at rest in still air instead, as a model with Q = c_q omega^2 does. Thrust and in-plane force stay.
// Source: Bramwell, Helicopter Dynamics: Q = Q_profile (1 + 4.5 mu^2) - (T lambda + H mu) R.
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/rotor/what_if.hpp"

namespace rotorloop::sim {
namespace {

class TorqueAdvance final : public Effect {
 public:
  explicit TorqueAdvance(const EffectValues& v) : share_(v[0]) {}
  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    if (share_ == 1.0) return;
    RotorCondition still = s.condition;
    still.v_R_m_s.setZero();
    still.w_R_rad_s.setZero();
    add_shaft_torque(loads, s.condition.spin, (1.0 - share_) * (what_if_(s, still).shaft_torque_N_m - s.bare.shaft_torque_N_m));
  }

 private:
  double share_;
  WhatIf what_if_;
};

}  // namespace

const EffectInfo kTorqueAdvance{
    .id = "torque_advance", .parameter = {"share", "1", 0.0, 1.0, 1.0}, .options = {}, .make = make_effect<TorqueAdvance>};

}  // namespace rotorloop::sim
