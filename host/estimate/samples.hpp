// What the estimator is given: readings as they arrived over the bus, each with the time at which it was measured.
// Frames: B body, W world (docs: x-forward, y-left, z-up; quaternion w,x,y,z body to world).
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

namespace rotorloop::host {

struct ImuSample {
  std::int64_t time_us = 0;  // airframe clock
  Eigen::Vector3d gyro_B_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_B_m_s2 = Eigen::Vector3d::Zero();  // specific force: +g on z at rest
};

struct PoseSample {
  std::int64_t time_us = 0;                         // measurement time on the airframe clock; arrival is later
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();  // of the sensor, not of the centre of mass
  Eigen::Quaterniond q_WS = Eigen::Quaterniond::Identity();
  Eigen::Vector3d v_W_m_s = Eigen::Vector3d::Zero();  // of the sensor
};

// What the controller gets, and all that it gets.
struct StateEstimate {
  std::int64_t time_us = 0;
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();  // centre of mass
  Eigen::Vector3d v_W_m_s = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_B_rad_s = Eigen::Vector3d::Zero();
  bool valid = false;  // initialised and not coasting on IMU alone for too long
};

}  // namespace rotorloop::host
