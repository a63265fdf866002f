#pragma once
#include <Eigen/Core>
#include <array>

#include "bench/sysid/estimate/model/body_state.hpp"

namespace rotorloop::diagnose {

// What acts at a sample, for directions of loads.
struct SampleState {
  estimate::BodyState x;
  std::array<double, 4> omega_rad_s{}, thrust_N{};
  std::array<double, 4> yaw_by_omega_N_m_s{};  // slope of the torque about z by each rotor's speed
  std::array<Eigen::Vector3d, 4> arm_B_m;      // hub from the centre of mass
  double induced_hover_m_s = 0.0;              // of a rotor that gives a quarter of the thrust at rest
  double mass_kg = 0.0, step_s = 0.0;
  Eigen::Vector3d v_B_m_s = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 6, 2> wrench_by_wind =
      Eigen::Matrix<double, 6, 2>::Zero();          // of the model, by air moving along world x, y: N s/m, N s
  Eigen::Matrix<double, 12, 6> whitened_by_wrench;  // residual rows of a step by a constant body wrench over it
};

}  // namespace rotorloop::diagnose
