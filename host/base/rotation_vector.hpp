// Rotation vectors, in rad: exponential and logarithm, exact also for small turns.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace rotorloop {

inline Eigen::Quaterniond exp_q(const Eigen::Vector3d& a) {
  const double t2 = a.squaredNorm(), t = std::sqrt(t2);
  const double s = t < 1e-4 ? 0.5 - t2 / 48.0 : std::sin(0.5 * t) / t;
  const double c = t < 1e-4 ? 1.0 - t2 / 8.0 : std::cos(0.5 * t);
  return {c, s * a.x(), s * a.y(), s * a.z()};
}

// The shortest rotation vector of a unit quaternion.
inline Eigen::Vector3d log_q(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0, w = sign * q.w(), s = q.vec().norm();
  const double angle_over_s = s < 1e-6 ? 2.0 / w * (1.0 - s * s / (3.0 * w * w)) : 2.0 * std::atan2(s, w) / s;
  return sign * angle_over_s * q.vec();
}

}  // namespace rotorloop
