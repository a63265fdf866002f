// Body rates move the hubs: Omega x r adds to the velocity that each rotor meets, and tilts the inflow across each disk. The
// rotor that goes down thrusts more than the one that goes up, so hover damps roll and pitch by 1.9 mN m s here. A plant has it;
// share scales both parts. The yaw rate keeps turning the blades through the air (it adds to omega, not to the inflow).
// Source: kinematics of a rigid body; Amer 1950 for the damping of a single rotor.
#include <Eigen/Geometry>

#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

void rotor_local_inflow(const EffectValues& v, const RotorSite& s, RotorCondition& c) {
  const double share = v[0];
  c.v_R_m_s -= (1.0 - share) * (s.R_BR.transpose() * s.body->w_B_rad_s.cross(s.hub_B_m));
  c.w_R_rad_s.x() *= share;
  c.w_R_rad_s.y() *= share;
}

}  // namespace

const EffectInfo kRotorLocalInflow{
    .id = "rotor_local_inflow", .parameter = {"share", "1", 0.0, 1.3, 1.0}, .options = {}, .make = effect_of<rotor_local_inflow>};

}  // namespace rotorloop::sim
