// Loads by bracketed roots, motion by the midpoint rule.
#include "test/support/model_true_airframe.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "host/base/elementary.hpp"

namespace rotorloop::model_true {
namespace {

// Root of a continuous `f` with f(low) > 0 > f(high): regula falsi, the value kept at a stuck end halved (Illinois).
template <class F>
double root_between(double low, double high, double f_low, double f_high, double tolerance, const F& f) {
  int stuck = 0;
  double x = low;
  for (int i = 0; i < 100; ++i) {
    x = (low * f_high - high * f_low) / (f_high - f_low);
    const double fx = f(x);
    if (std::fabs(fx) <= tolerance || high - low <= 1e-14 * std::fabs(high)) break;
    if (fx > 0) {
      low = x;
      f_low = fx;
      if (stuck > 0) f_high *= 0.5;
      stuck = 1;
    } else {
      high = x;
      f_high = fx;
      if (stuck < 0) f_low *= 0.5;
      stuck = -1;
    }
  }
  return x;
}

double disk(const Truth& t) { return 2.0 * t.air_density_kg_m3 * std::numbers::pi * t.radius_m * t.radius_m; }  // 2ρA, kg/m

double in_plane_squared(const Eigen::Vector3d& v) { return v.x() * v.x() + v.y() * v.y(); }

}  // namespace

RotorThrust rotor_thrust(const Truth& truth, double omega, const Eigen::Vector3d& v_B) {
  const double vz = v_B.z(), vxy2 = in_plane_squared(v_B), two_rho_A = disk(truth);
  const double stand = truth.k1_N_s2 * omega * omega, slope = truth.k2_N_s2_m * omega;
  // Eq. 1 less eq. 2: falls with v wherever v + v_z > 0, so that one root lies between no through-flow and no blade thrust.
  const auto excess = [&](double v) {
    const double w = vz + v;
    return stand + slope * w - two_rho_A * v * std::sqrt(w * w + vxy2);
  };
  const double low = std::max(0.0, -vz), high = -stand / slope - vz;
  const double f_low = excess(low), f_high = high > low ? excess(high) : 0.0;
  if (!(f_low > 0.0 && f_high < 0.0)) throw std::domain_error("rotor outside v_z + v_ind > 0, where eq. 1 and 2 do not hold");
  const double v = root_between(low, high, f_low, f_high, 1e-15 * stand, excess);
  return {stand + slope * (vz + v), v};
}

double rotor_speed_for(const Truth& truth, double thrust_N, const Eigen::Vector3d& v_B) {
  const double vz = v_B.z(), vxy2 = in_plane_squared(v_B), two_rho_A = disk(truth);
  const auto missing = [&](double v) { return thrust_N - two_rho_A * v * std::sqrt((vz + v) * (vz + v) + vxy2); };
  const double low = std::max(0.0, -vz), high = low + 1.0 + std::sqrt(thrust_N / two_rho_A);
  const double f_low = missing(low);
  const double v = f_low <= 0.0 ? low : root_between(low, high, f_low, missing(high), 1e-12 * thrust_N, missing);
  const double b = truth.k2_N_s2_m * (vz + v);
  return (-b + std::sqrt(b * b + 4.0 * truth.k1_N_s2 * thrust_N)) / (2.0 * truth.k1_N_s2);
}

double static_thrust_coefficient(const Truth& truth) {
  // v_ind = xω at rest: 2ρA x² − k2 x − k1 = 0, c_t = 2ρA x².
  const double d = disk(truth);
  const double x = (truth.k2_N_s2_m + std::sqrt(truth.k2_N_s2_m * truth.k2_N_s2_m + 4.0 * d * truth.k1_N_s2)) / (2.0 * d);
  return d * x * x;
}

Loads loads(const Truth& truth, const State& state, const RotorSpeeds& omega) {
  const Eigen::Vector3d v = state.q_WB.conjugate() * state.v_W_m_s;
  Loads out;
  RotorSpeeds T{};
  out.through_flow_m_s = 1e9;
  for (std::size_t i = 0; i < 4; ++i) {
    const RotorThrust r = rotor_thrust(truth, omega[i], v);
    T[i] = r.thrust_N;
    out.through_flow_m_s = std::min(out.through_flow_m_s, v.z() + r.induced_m_s);
  }
  const double l = truth.arm_m, dx = truth.com_offset_m.x(), dy = truth.com_offset_m.y(), sum = T[0] + T[1] + T[2] + T[3];
  const auto square = [&](std::size_t i) { return omega[i] * omega[i]; };
  out.torque_B_N_m = {-T[0] * (l + dy) + T[1] * (l - dy) + T[2] * (l - dy) - T[3] * (l + dy),
                      -T[0] * (l - dx) + T[1] * (l + dx) - T[2] * (l - dx) + T[3] * (l + dx),
                      truth.c_q_N_m_s2 * (square(2) + square(3) - square(0) - square(1))};
  out.force_B_N = {-sum * truth.c_dh_s_m * v.x() - truth.c_dxy_N_s2_m2 * v.x() * std::fabs(v.x()),
                   -sum * truth.c_dh_s_m * v.y() - truth.c_dxy_N_s2_m2 * v.y() * std::fabs(v.y()),
                   sum - truth.c_dz_N_s2_m2 * v.z() * std::fabs(v.z())};
  return out;
}

Eigen::Quaterniond exponential(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  if (angle < 1e-9) return Eigen::Quaterniond(1.0, phi.x() / 2, phi.y() / 2, phi.z() / 2).normalized();
  const SinCos half = sincos_exact(angle / 2);
  const Eigen::Vector3d axis = phi * (half.sin / angle);
  return {half.cos, axis.x(), axis.y(), axis.z()};
}

namespace {

struct Rates {
  Eigen::Vector3d acceleration_W, angular_acceleration_B;
  double through_flow;
};
Rates rates(const Truth& truth, const State& x, const RotorSpeeds& omega) {
  const Loads l = loads(truth, x, omega);
  const Eigen::Vector3d& I = truth.inertia_kg_m2;
  const Eigen::Vector3d gyroscopic = x.omega_B_rad_s.cross(I.cwiseProduct(x.omega_B_rad_s));
  return {x.q_WB * l.force_B_N / truth.mass_kg - Eigen::Vector3d(0, 0, kGravity_m_s2), (l.torque_B_N_m - gyroscopic).cwiseQuotient(I),
          l.through_flow_m_s};
}

}  // namespace

State advance(const Truth& truth, const State& x, const RotorSpeeds& begin, const RotorSpeeds& middle, double h, double* through_flow) {
  const Rates k1 = rates(truth, x, begin);
  State m;
  m.p_W_m = x.p_W_m + h / 2 * x.v_W_m_s;
  m.v_W_m_s = x.v_W_m_s + h / 2 * k1.acceleration_W;
  m.q_WB = x.q_WB * exponential(h / 2 * x.omega_B_rad_s);
  m.omega_B_rad_s = x.omega_B_rad_s + h / 2 * k1.angular_acceleration_B;
  const Rates k2 = rates(truth, m, middle);
  State y;
  y.p_W_m = x.p_W_m + h * m.v_W_m_s;
  y.v_W_m_s = x.v_W_m_s + h * k2.acceleration_W;
  y.q_WB = (x.q_WB * exponential(h * m.omega_B_rad_s)).normalized();
  y.omega_B_rad_s = x.omega_B_rad_s + h * k2.angular_acceleration_B;
  if (through_flow) *through_flow = std::min({*through_flow, k1.through_flow, k2.through_flow});
  return y;
}

}  // namespace rotorloop::model_true
