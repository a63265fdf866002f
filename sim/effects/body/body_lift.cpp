// A body that deflects the air it flies through is lifted or pressed down: force k_L v_xy^2 along body z, in proportion to the
// density (k_L at 1.225 kg/m^3). A flat frame pitched into the wind as a quadrotor flies is pressed down, k_L < 0; a
// canopy or arms with incidence may lift. Source: wing in a uniform stream, lift with dynamic pressure.
#include "sim/effects/body/air_density.hpp"
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void body_lift(const EffectValues& v, const BodyMotion& m, Wrench& w) {
  const double k_L_N_s2_m2 = v[0];
  w.force_B_N.z() += density_ratio(m) * k_L_N_s2_m2 * m.v_air_B_m_s.head<2>().squaredNorm();
}

}  // namespace

const EffectInfo kBodyLift{
    .id = "body_lift", .parameter = {"k_L_N_s2_m2", "N s^2/m^2", -0.02, 0.02, 0.0}, .options = {}, .make = effect_of<body_lift>};

}  // namespace rotorloop::sim
