// Air resists turning in proportion to the rate: moment -c Omega about roll and pitch, -yaw_share c Omega_z about yaw. It is
// what a vehicle shows beyond the damping of its rotors as the blade-element model gives it; the coefficient lumps density and
// rotor speed and follows neither. Source: wind-tunnel derivative Cm_q = -0.135 of a Bebop (Sun, de Visser, Chu 2019), 3.9 mN m
// per rad/s on this vehicle; rotor damping of Amer, NACA TN 2136, 1950.
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void rate_damping(const EffectValues& v, const BodyMotion& m, Wrench& w) {
  const Eigen::Vector3d c_N_m_s(v[0], v[0], v[0] * v[1]);
  w.moment_B_N_m -= c_N_m_s.cwiseProduct(m.w_B_rad_s);
}

constexpr EffectOption kRateDampingOptions[] = {{"yaw_share", "1", 0.0, 2.0, 1.0}};

}  // namespace

const EffectInfo kRateDamping{.id = "rate_damping",
                              .parameter = {"c_N_m_s", "N m s", 0.0, 0.02, 0.0},
                              .options = kRateDampingOptions,
                              .make = effect_of<rate_damping>};

}  // namespace rotorloop::sim
