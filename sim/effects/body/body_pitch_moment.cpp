// The stream turns the body about the axis across it: moment k_m |v| (-v_y, v_x, 0), v through the air, in proportion to the
// density (k_m at 1.225 kg/m^3). k_m < 0 raises the side that meets the air (pitch-up in forward flight), as wind-tunnel tests
// of quadrotors find: pitching coefficients of 1e-3 to 3e-3 (Sun, de Visser, Chu 2019, tables 5 and 8), 19 to 57 mN m here at
// 8.5 m/s. Part of that is the front rotors' wake on the rear ones; this is the part that does not depend on thrust.
#include "sim/effects/body/air_density.hpp"
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void body_pitch_moment(const EffectValues& v, const BodyMotion& m, Wrench& w) {
  const double k_m_N_s2_m = v[0];
  const Eigen::Vector3d& v_air = m.v_air_B_m_s;
  const double k_N_s = density_ratio(m) * k_m_N_s2_m * v_air.norm();
  w.moment_B_N_m.x() -= k_N_s * v_air.y();
  w.moment_B_N_m.y() += k_N_s * v_air.x();
}

}  // namespace

const EffectInfo kBodyPitchMoment{.id = "body_pitch_moment",
                                  .parameter = {"k_m_N_s2_m", "N s^2/m", -2e-3, 2e-3, 0.0},
                                  .options = {},
                                  .make = effect_of<body_pitch_moment>};

}  // namespace rotorloop::sim
