#include "host/control/attitude.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/elementary.hpp"

namespace rotorloop::host {

namespace {
constexpr double kNoseVertical = 0.05;  // sine of the angle between thrust and the wanted heading below which yaw says nothing
}

AttitudeSetpoint flat_attitude(const Eigen::Vector3d& specific_thrust_W_m_s2, const Eigen::Vector3d& jerk_W_m_s3, double yaw_rad,
                               double yaw_rate_rad_s, Heading& heading) {
  AttitudeSetpoint out;
  const double magnitude = specific_thrust_W_m_s2.norm();
  Eigen::Vector3d z_dot = Eigen::Vector3d::Zero();
  if (magnitude > kFreeFall_m_s2) {
    heading.z_W = specific_thrust_W_m_s2 / magnitude;
    z_dot = (jerk_W_m_s3 - heading.z_W * heading.z_W.dot(jerk_W_m_s3)) / magnitude;
  } else {
    out.direction_held = true;
  }
  const Eigen::Vector3d& z = heading.z_W;
  // The nose points along the wanted heading as seen from above: y is normal to it and to the thrust.
  const SinCos yaw = sincos_exact(yaw_rad);
  const Eigen::Vector3d forward(yaw.cos, yaw.sin, 0.0), forward_dot = yaw_rate_rad_s * Eigen::Vector3d(-yaw.sin, yaw.cos, 0.0);
  Eigen::Vector3d y = z.cross(forward);
  const double span = y.norm();
  double w_z = 0.0;
  if (span > kNoseVertical) {
    y /= span;
    const Eigen::Vector3d y_dot = (z_dot.cross(forward) + z.cross(forward_dot)) / span;  // up to a part along y
    w_z = -y.cross(z).dot(y_dot);
  } else {
    y = heading.y_W - z * z.dot(heading.y_W);
    const double kept = y.norm();
    y = kept > kNoseVertical ? (y / kept).eval() : z.unitOrthogonal();
  }
  heading.y_W = y;
  const Eigen::Vector3d x = y.cross(z);
  out.R_WB.col(0) = x;
  out.R_WB.col(1) = y;
  out.R_WB.col(2) = z;
  // ż = w_y x - w_x y
  out.w_B_rad_s = {-y.dot(z_dot), x.dot(z_dot), w_z};
  return out;
}

AttitudeError attitude_error(const Eigen::Matrix3d& R_WB, const Eigen::Vector3d& w_B_rad_s, const AttitudeSetpoint& setpoint) {
  const Eigen::Matrix3d error = setpoint.R_WB.transpose() * R_WB;
  AttitudeError out;
  const Eigen::Vector3d skew(error(2, 1) - error(1, 2), error(0, 2) - error(2, 0), error(1, 0) - error(0, 1));
  const double four_cos2 = std::max(1.0 + error.trace(), 0.0);  // 4 cos²(θ/2)
  if (four_cos2 > 1e-6) {
    out.angle_rad = skew / std::sqrt(four_cos2);
  } else {
    // Half a turn: the axis is the largest column of R + I; either sense of rotation is as short.
    Eigen::Index column = 0;
    error.diagonal().maxCoeff(&column);
    Eigen::Vector3d axis = error.col(column);
    axis[column] += 1.0;
    out.angle_rad = 2.0 * axis / std::max(axis.norm(), 1e-9);
    if (out.angle_rad.dot(skew) < 0.0) out.angle_rad = -out.angle_rad;
  }
  out.rate_rad_s = w_B_rad_s - error.transpose() * setpoint.w_B_rad_s;
  return out;
}

}  // namespace rotorloop::host
