#include "host/control/trajectory.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::host {

namespace {

// kFalling[n][k] = k! / (k-n)!: what the n-th derivative leaves in front of t^(k-n).
constexpr auto kFalling = [] {
  std::array<std::array<double, kCoefficients>, kCoefficients> table{};
  for (std::size_t n = 0; n < kCoefficients; ++n)
    for (std::size_t k = n; k < kCoefficients; ++k) {
      double factor = 1.0;
      for (std::size_t i = 0; i < n; ++i) factor *= static_cast<double>(k - i);
      table[n][k] = factor;
    }
  return table;
}();

bool moves(const Segment& s) { return !(s.x_m.constant() && s.y_m.constant() && s.z_m.constant() && s.yaw_rad.constant()); }

}  // namespace

double Polynomial::at(double t_s, std::size_t n) const {
  double value = 0.0;
  for (std::size_t k = kCoefficients; k-- > n;) value = value * t_s + kFalling[n][k] * c[k];
  return value;
}

bool Polynomial::constant() const {
  return std::all_of(c.begin() + 1, c.end(), [](double v) { return v == 0.0; });
}

double Trajectory::duration_s() const {
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) sum += segments[i].duration_s;
  return sum;
}

Setpoint Trajectory::at(double t_s) const {
  Setpoint out;
  if (count == 0) return out;
  double t = std::isnan(t_s) ? 0.0 : t_s;
  const bool before = t < 0.0;
  t = std::max(t, 0.0);
  std::size_t i = 0;
  while (i + 1 < count && t >= segments[i].duration_s) t -= segments[i++].duration_s;
  const Segment& s = segments[i];
  const bool after = t > s.duration_s;
  t = std::min(t, s.duration_s);
  const auto vector = [&](std::size_t n) { return Eigen::Vector3d(s.x_m.at(t, n), s.y_m.at(t, n), s.z_m.at(t, n)); };
  out.p_W_m = vector(0);
  out.yaw_rad = s.yaw_rad.at(t, 0);
  if (before || after) return out;
  out.v_W_m_s = vector(1);
  out.a_W_m_s2 = vector(2);
  out.j_W_m_s3 = vector(3);
  out.s_W_m_s4 = vector(4);
  out.yaw_rate_rad_s = s.yaw_rad.at(t, 1);
  out.yaw_accel_rad_s2 = s.yaw_rad.at(t, 2);
  return out;
}

double Trajectory::first_motion_s() const {
  double t = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    if (moves(segments[i])) return t;
    t += segments[i].duration_s;
  }
  return 0.0;
}

double Trajectory::last_motion_s() const {
  double t = 0.0, last = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    t += segments[i].duration_s;
    if (moves(segments[i])) last = t;
  }
  return last;
}

}  // namespace rotorloop::host
