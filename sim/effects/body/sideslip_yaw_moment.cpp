// A body that is longer than wide turns in a skewed stream: yaw moment k_n v_x v_y, v through the air, in proportion to the
// density (k_n at 1.225 kg/m^3). That is k_n v^2 sin(2 beta) / 2 with sideslip beta, the first term that a body with two planes
// of symmetry can have. k_n > 0 turns the nose into the direction of flight (weathervane), k_n < 0 across it (the moment of
// an elongated body in ideal flow: Munk 1924). Up to 40 mN m were measured on a Bebop beyond 40 degrees of sideslip
// (Sun, de Visser, Chu 2019, fig. 11); with k_n = 1e-3 N s^2/m it is 36 mN m at 8.5 m/s and 45 degrees.
#include "sim/effects/body/air_density.hpp"
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void sideslip_yaw_moment(const EffectValues& v, const BodyMotion& m, Wrench& w) {
  const double k_n_N_s2_m = v[0];
  w.moment_B_N_m.z() += density_ratio(m) * k_n_N_s2_m * m.v_air_B_m_s.x() * m.v_air_B_m_s.y();
}

}  // namespace

const EffectInfo kSideslipYawMoment{.id = "sideslip_yaw_moment",
                                    .parameter = {"k_n_N_s2_m", "N s^2/m", -3e-3, 3e-3, 0.0},
                                    .options = {},
                                    .make = effect_of<sideslip_yaw_moment>};

}  // namespace rotorloop::sim
