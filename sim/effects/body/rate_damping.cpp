// Air resists turning in proportion to the rate: moment -c Omega about roll and pitch, -yaw_share c Omega_z about yaw. It is
// what a vehicle shows beyond the damping of its rotors as the blade-element solve gives it; the coefficient lumps density and
// rotor speed and follows neither. Source: wind-tunnel derivative Cm_q = -0.135 of a Bebop (Sun, de Visser, Chu 2019), 3.9 mN m
// per rad/s on this vehicle; rotor damping of Amer, NACA TN 2136, 1950.
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

class RateDamping final : public Effect {
 public:
  explicit RateDamping(const EffectValues& v) : c_N_m_s_(v[0], v[0], v[0] * v[1]) {}
  void body_loads(const BodyMotion& m, Wrench& w) const override { w.moment_B_N_m -= c_N_m_s_.cwiseProduct(m.w_B_rad_s); }

 private:
  Eigen::Vector3d c_N_m_s_;
};

constexpr EffectOption kOptions[] = {{"yaw_share", "1", 0.0, 2.0, 1.0}};

}  // namespace

const EffectInfo kRateDamping{
    .id = "rate_damping", .parameter = {"c_N_m_s", "N m s", 0.0, 0.02, 0.0}, .options = kOptions, .make = make_effect<RateDamping>};

}  // namespace rotorloop::sim
