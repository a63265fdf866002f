// Body rates move the hubs: Omega x r adds to the velocity that each rotor meets, and tilts the inflow across each disk. The
// rotor that goes down thrusts more than the one that goes up, so hover damps roll and pitch by 1.9 mN m s here. A plant has it;
// share scales both parts. The yaw rate keeps turning the blades through the air (it adds to omega, not to the inflow).
// Source: kinematics of a rigid body; Amer 1950 for the damping of a single rotor.
#include <Eigen/Geometry>

#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class RotorLocalInflow final : public Effect {
 public:
  explicit RotorLocalInflow(const EffectValues& v) : share_(v[0]) {}
  void rotor_condition(const RotorSite& s, RotorCondition& c) const override {
    c.v_R_m_s -= (1.0 - share_) * (s.R_BR.transpose() * s.body->w_B_rad_s.cross(s.hub_B_m));
    c.w_R_rad_s.x() *= share_;
    c.w_R_rad_s.y() *= share_;
  }

 private:
  double share_;
};

}  // namespace

const EffectInfo kRotorLocalInflow{
    .id = "rotor_local_inflow", .parameter = {"share", "1", 0.0, 1.3, 1.0}, .options = {}, .make = make_effect<RotorLocalInflow>};

}  // namespace rotorloop::sim
