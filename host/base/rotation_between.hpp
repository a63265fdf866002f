// The shortest rotation that turns one direction into another.
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace rotorloop {

// Unit quaternion that turns `from` into the direction of `to`; neither may be zero. Of opposite directions the axis is any
// perpendicular one. Eigen's FromTwoVectors finds that axis by a singular value decomposition, which takes 10 s to compile in each file
// that calls it.
inline Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  constexpr double kOpposite = 1e-12;  // 1 + cosine: less is rounding
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const double cosine = b.dot(a);
  if (cosine < -1.0 + kOpposite) return Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, a.unitOrthogonal()));
  const double s = std::sqrt((1.0 + cosine) * 2.0), inverse = 1.0 / s;
  const Eigen::Vector3d axis = a.cross(b) * inverse;
  return {0.5 * s, axis.x(), axis.y(), axis.z()};
}

}  // namespace rotorloop
