// Where the vehicle shall be at one instant: what a trajectory yields and the position controller follows.
#pragma once
#include <Eigen/Core>

namespace rotorloop::host {

struct Setpoint {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();  // of the centre of mass
  Eigen::Vector3d v_W_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d a_W_m_s2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d j_W_m_s3 = Eigen::Vector3d::Zero();
  Eigen::Vector3d s_W_m_s4 = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  double yaw_rate_rad_s = 0.0;
  double yaw_accel_rad_s2 = 0.0;
};

}  // namespace rotorloop::host
