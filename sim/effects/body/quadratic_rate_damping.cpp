// Plates, arms and guards that are swept through the air by a rotation resist with its square: moment -d_2 |Omega| Omega, in
// proportion to the density (d_2 at 1.225 kg/m^3). A strip of width b with drag coefficient c_d from the centre to radius R has
// d_2 = rho c_d b R^4 / 8: four 90 mm arms of 15 mm give 1e-6 N m s^2, propeller guards or plates of 0.1 m at 0.15 m about
// 1e-4. Source: drag of a blade element, integrated over the arm.
#include "sim/effects/body/air_density.hpp"
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void quadratic_rate_damping(const EffectValues& v, const BodyMotion& m, Wrench& w) {
  const double d2_N_m_s2 = v[0];
  w.moment_B_N_m -= (density_ratio(m) * d2_N_m_s2 * m.w_B_rad_s.norm()) * m.w_B_rad_s;
}

}  // namespace

const EffectInfo kQuadraticRateDamping{.id = "quadratic_rate_damping",
                                       .parameter = {"d2_N_m_s2", "N m s^2", 0.0, 2e-3, 0.0},
                                       .options = {},
                                       .make = effect_of<quadratic_rate_damping>};

}  // namespace rotorloop::sim
