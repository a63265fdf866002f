// How uncertain one step of the model and each measurement is. Process noise: white acceleration densities, constant over a flight.
#pragma once
#include <Eigen/Core>

namespace rotorloop::estimate {

struct NoiseModel {
  // Process, one-sided root densities per world axis (force) and body axis (torque): over a step h the velocity wanders by q sqrt(h).
  Eigen::Vector3d force_m_s2_rtHz = Eigen::Vector3d::Constant(0.05);
  Eigen::Vector3d angular_rad_s2_rtHz = Eigen::Vector3d::Constant(0.5);
  // Measurements, standard deviations per axis.
  Eigen::Vector3d position_m = Eigen::Vector3d::Constant(2e-3);
  Eigen::Vector3d attitude_rad = Eigen::Vector3d::Constant(2e-3);
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Constant(5e-2);
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Constant(2e-2);
  Eigen::Vector3d accel_m_s2 = Eigen::Vector3d::Constant(3e-1);
};

}  // namespace rotorloop::estimate
