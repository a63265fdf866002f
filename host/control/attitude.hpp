// Attitude: from the wanted thrust vector and yaw to attitude and body rates (differential flatness, Mellinger and Kumar 2011),
// and from their errors to a torque (Lee, Leok and McClamroch on SO(3)), without feed-forward torque as in the paper.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace rotorloop::host {

// The attitude set-point of the last step: what is kept when the thrust vector or the yaw says nothing.
struct Heading {
  Eigen::Vector3d z_W = Eigen::Vector3d::UnitZ();  // thrust direction
  Eigen::Vector3d y_W = Eigen::Vector3d::UnitY();
};

struct AttitudeSetpoint {
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d w_B_rad_s = Eigen::Vector3d::Zero();  // in the axes of the set-point
  bool direction_held = false;                          // less thrust than kFreeFall_m_s2: the last direction is kept
};

// Specific thrust below which its direction carries no meaning.
inline constexpr double kFreeFall_m_s2 = 0.5;

// a: wanted thrust over mass (W, m/s²); j: its derivative (m/s³; the set-point's jerk, drag left out).
AttitudeSetpoint flat_attitude(const Eigen::Vector3d& specific_thrust_W_m_s2, const Eigen::Vector3d& jerk_W_m_s3, double yaw_rad,
                               double yaw_rate_rad_s, Heading& heading);

struct AttitudeError {
  Eigen::Vector3d angle_rad;   // 2 sin(θ/2) along the axis of the error, from set-point to actual, in B
  Eigen::Vector3d rate_rad_s;  // actual minus set-point, in B
};
// The error function is 2 - sqrt(1 + tr(R_spᵀ R)) (Lee 2012): like the usual one for small angles, but it keeps growing up
// to half a turn instead of vanishing there.
AttitudeError attitude_error(const Eigen::Matrix3d& R_WB, const Eigen::Vector3d& w_B_rad_s, const AttitudeSetpoint& setpoint);

}  // namespace rotorloop::host
