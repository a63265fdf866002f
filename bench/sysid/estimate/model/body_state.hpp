// What a rigid body does at one moment; apart from the model, so that what drives the model may know it too.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace rotorloop::estimate {

struct BodyState {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_W_m_s = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_B_rad_s = Eigen::Vector3d::Zero();
};

}  // namespace rotorloop::estimate
