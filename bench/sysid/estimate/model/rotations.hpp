// Small rotations, exact: exponential, logarithm and right Jacobian of rotation vectors. Attitude errors act on the right,
// q = q̂ Exp(δφ), so δφ is a rotation about body axes.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "host/base/rotation_vector.hpp"

namespace rotorloop::estimate {

using rotorloop::exp_q;
using rotorloop::log_q;

inline Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

// Exp(a + δ) = Exp(a) Exp(J δ) to first order.
inline Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& a) {
  const double t2 = a.squaredNorm(), t = std::sqrt(t2);
  const double b = t < 1e-3 ? 0.5 - t2 / 24.0 : (1.0 - std::cos(t)) / t2;
  const double c = t < 1e-3 ? 1.0 / 6.0 - t2 / 120.0 : (t - std::sin(t)) / (t2 * t);
  const Eigen::Matrix3d k = skew(a);
  return Eigen::Matrix3d::Identity() - b * k + c * k * k;
}

// Inverses of the right Jacobian, and of the left one (its transpose): Log(Exp(a) Exp(δ)) = a + Jr⁻¹δ, Log(Exp(δ) Exp(a)) = a + Jl⁻¹δ.
inline Eigen::Matrix3d inverse_right_jacobian(const Eigen::Vector3d& a) {
  const double t2 = a.squaredNorm(), t = std::sqrt(t2);
  const double c = t < 1e-3 ? 1.0 / 12.0 + t2 / 720.0 : 1.0 / t2 - (1.0 + std::cos(t)) / (2.0 * t * std::sin(t));
  const Eigen::Matrix3d k = skew(a);
  return Eigen::Matrix3d::Identity() + 0.5 * k + c * k * k;
}
inline Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& a) { return inverse_right_jacobian(a).transpose(); }

}  // namespace rotorloop::estimate
