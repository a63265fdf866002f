// Sums of sines as references, proportional-derivative feedback on position and attitude, feed-forward by numerical derivatives.
#include "test/support/model_true_pilot.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"

namespace rotorloop::model_true {
namespace {

// One sine, given by its peak rate (m/s or rad/s) and frequency, so that the envelope of a flight can be read off the numbers.
double sine(double t_s, double peak_rate, double frequency_Hz, double phase_rad = 0.0) {
  const double w = 2.0 * std::numbers::pi * frequency_Hz;
  return peak_rate / w * sin_exact(w * t_s + phase_rad);
}
// The same motion from one end to the other: starts at 0 without speed.
double swing(double t_s, double peak_rate, double frequency_Hz) {
  return sine(t_s, peak_rate, frequency_Hz, -std::numbers::pi / 2) + peak_rate / (2.0 * std::numbers::pi * frequency_Hz);
}

// 0 to 1 with three continuous derivatives, and its integral: a time that starts from rest and runs true after `over_s`.
double ease_in(double t_s, double over_s) {
  const double x = std::clamp(t_s / over_s, 0.0, 1.0);
  return x * x * x * x * (35.0 - x * (84.0 - x * (70.0 - 20.0 * x)));
}
double eased_time(double t_s, double over_s) {
  if (t_s >= over_s) return t_s - over_s / 2;
  const double x = std::max(t_s / over_s, 0.0);
  return over_s * x * x * x * x * x * (7.0 - x * (14.0 - x * (10.0 - 2.5 * x)));
}

// Feed-forward acceleration of the reference position, by the central difference: exact to 1e-6 for sines below 3 Hz.
Eigen::Vector3d acceleration(const Path& path, double t_s) {
  constexpr double e = 1e-3;
  return (path(t_s + e).p_W_m - 2.0 * path(t_s).p_W_m + path(t_s - e).p_W_m) / (e * e);
}

// Attitude whose z axis is along `thrust_W` and whose x axis is as near to the heading as that allows.
Eigen::Quaterniond attitude_of(const Eigen::Vector3d& thrust_W, const Reference& r) {
  const SinCos yaw = sincos_exact(r.yaw_rad);
  const Eigen::Vector3d z = thrust_W.normalized();
  const Eigen::Vector3d y = z.cross(Eigen::Vector3d(yaw.cos, yaw.sin, 0.0)).normalized();
  Eigen::Matrix3d R;
  R << y.cross(z), y, z;
  return Eigen::Quaterniond(R) * exponential(r.tilt_B_rad);
}

Eigen::Quaterniond planned_attitude(const Path& path, double t_s) {
  return attitude_of(acceleration(path, t_s) + Eigen::Vector3d(0, 0, kGravity_m_s2), path(t_s));
}

// Rotation vector from `a` to `b` in the frame of `a`, to second order for small angles.
Eigen::Vector3d between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond d = a.conjugate() * b;
  return (d.w() < 0 ? -2.0 : 2.0) * d.vec();
}

// Thrusts of the four rotors for total thrust and torque, with the static c_t standing in for the dynamic one in yaw.
Eigen::Vector4d allocate(const Truth& t, double thrust_N, const Eigen::Vector3d& torque_N_m) {
  const double l = t.arm_m, dx = t.com_offset_m.x(), dy = t.com_offset_m.y(), q = t.c_q_N_m_s2 / static_thrust_coefficient(t);
  Eigen::Matrix4d m;
  m << 1, 1, 1, 1, -(l + dy), l - dy, l - dy, -(l + dy), -(l - dx), l + dx, -(l - dx), l + dx, -q, -q, q, q;
  return m.inverse() * Eigen::Vector4d(thrust_N, torque_N_m.x(), torque_N_m.y(), torque_N_m.z());
}

}  // namespace

const char* name_of(Manoeuvre manoeuvre) {
  switch (manoeuvre) {
    case Manoeuvre::vertical:
      return "vertical";
    case Manoeuvre::horizontal:
      return "horizontal";
    default:
      return "rotation";
  }
}

Reference reference(Manoeuvre manoeuvre, double t) {
  Reference r;
  const double u = eased_time(t, 1.0);
  switch (manoeuvre) {
    case Manoeuvre::vertical:
      r.p_W_m.z() = swing(u, 2.5, 0.25) + swing(u, 0.9, 0.85);
      break;
    case Manoeuvre::horizontal:
      r.p_W_m.x() = swing(u, 9.4, 0.154) + swing(u, 0.8, 0.34);
      r.p_W_m.y() = swing(u, 3.6, 0.227);
      break;
    case Manoeuvre::rotation: {
      // Yaw near what the rotors' reaction can do (c_q), roll and pitch fast (inertia), all at once (I_zz by the gyroscopic term).
      const double s = ease_in(t, 1.0);
      r.yaw_rad = swing(u, 5.5, 0.53);
      r.tilt_B_rad = s * Eigen::Vector3d(sine(t, 3.5, 2.7) + sine(t, 0.3, 3.1), sine(t, 3.9, 2.5, 1.0) + sine(t, 0.3, 2.9), 0.0);
      break;
    }
  }
  return r;
}

RotorSpeeds command(const Truth& truth, Manoeuvre m, double t, const State& x, const RotorSpeeds& now) {
  // In the rotation flight the sideways motion that its own tilt causes is to pass: gains below its frequencies there.
  return command(
      truth, [m](double at) { return reference(m, at); }, m == Manoeuvre::rotation, t, x, now);
}

RotorSpeeds command(const Truth& truth, const Path& path, bool loose, double t, const State& x, const RotorSpeeds& now) {
  constexpr double e = 1e-3;
  const double kPosition_1_s2 = loose ? 1.0 : 6.0, kVelocity_1_s = loose ? 1.4 : 4.0;
  const Eigen::Vector3d kAttitude_1_s2(150.0, 150.0, 40.0), kRate_1_s(22.0, 22.0, 10.0);  // 12 rad/s; yaw 6 rad/s, as c_q is small
  constexpr double kLead = 2.0, kLeast_N = 0.15, kMost_N = 6.0;

  const Reference r = path(t);
  const Eigen::Vector3d v_ref = (path(t + e).p_W_m - path(t - e).p_W_m) / (2 * e);
  const Eigen::Vector3d a = acceleration(path, t) + kPosition_1_s2 * (r.p_W_m - x.p_W_m) + kVelocity_1_s * (v_ref - x.v_W_m_s);
  const Eigen::Vector3d v_B = x.q_WB.conjugate() * x.v_W_m_s;
  // Drag is paid for in the thrust wanted: eq. 4 at hover thrust and eq. 5 are near enough for a pilot.
  const Eigen::Vector3d linear = Eigen::Vector3d(v_B.x(), v_B.y(), 0) * (truth.mass_kg * kGravity_m_s2 * truth.c_dh_s_m);
  const Eigen::Vector3d square =
      Eigen::Vector3d(truth.c_dxy_N_s2_m2, truth.c_dxy_N_s2_m2, truth.c_dz_N_s2_m2).cwiseProduct(v_B.cwiseProduct(v_B.cwiseAbs()));
  const Eigen::Vector3d wanted_W = truth.mass_kg * (a + Eigen::Vector3d(0, 0, kGravity_m_s2)) + x.q_WB * (linear + square);

  const Eigen::Quaterniond ahead = planned_attitude(path, t + e), here = planned_attitude(path, t), behind = planned_attitude(path, t - e);
  const Eigen::Vector3d rate = between(behind, ahead) / (2 * e);
  const Eigen::Vector3d rate_change = (between(here, ahead) - between(behind, here)) / (e * e);
  const Eigen::Vector3d alpha =
      rate_change + kAttitude_1_s2.cwiseProduct(between(x.q_WB, attitude_of(wanted_W, r))) + kRate_1_s.cwiseProduct(rate - x.omega_B_rad_s);
  const Eigen::Vector3d torque =
      truth.inertia_kg_m2.cwiseProduct(alpha) + x.omega_B_rad_s.cross(truth.inertia_kg_m2.cwiseProduct(x.omega_B_rad_s));
  const Eigen::Vector3d up = x.q_WB * Eigen::Vector3d::UnitZ();
  const double thrust = std::max(4 * kLeast_N, wanted_W.z() / std::max(0.5, up.z()));  // height first

  const Eigen::Vector4d T = allocate(truth, thrust, torque);
  RotorSpeeds out{};
  for (std::size_t i = 0; i < 4; ++i) {
    const double wanted = rotor_speed_for(truth, std::clamp(T[static_cast<Eigen::Index>(i)], kLeast_N, kMost_N), v_B);
    out[i] = std::clamp(now[i] + kLead * (wanted - now[i]), 250.0, 1800.0);
  }
  return out;
}

RotorSpeeds hover_speeds(const Truth& truth) {
  const Eigen::Vector4d T = allocate(truth, truth.mass_kg * kGravity_m_s2, Eigen::Vector3d::Zero());
  RotorSpeeds out{};
  for (std::size_t i = 0; i < 4; ++i) out[i] = rotor_speed_for(truth, T[static_cast<Eigen::Index>(i)], Eigen::Vector3d::Zero());
  return out;
}

}  // namespace rotorloop::model_true
