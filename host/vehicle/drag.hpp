// Drag after the paper's eq. (4) and (5), in body axes. Header-only: both are a line each.
#pragma once
#include "host/vehicle/model.hpp"

namespace rotorloop::host {

// Eq. (4): across the rotor axes, proportional to the thrust carried and to the velocity.
inline Eigen::Vector3d rotor_drag_B_N(const DragModel& m, double thrust_sum_N, const Eigen::Vector3d& v_B_m_s) {
  return {-thrust_sum_N * m.c_dh_s_m * v_B_m_s.x(), -thrust_sum_N * m.c_dh_s_m * v_B_m_s.y(), 0.0};
}

// Eq. (5): quadratic per axis.
inline Eigen::Vector3d airframe_drag_B_N(const DragModel& m, const Eigen::Vector3d& v_B_m_s) {
  const Eigen::Vector3d v = v_B_m_s;
  const double ax = v.x() < 0 ? -v.x() : v.x(), ay = v.y() < 0 ? -v.y() : v.y(), az = v.z() < 0 ? -v.z() : v.z();
  return {-m.c_dxy_N_s2_m2 * v.x() * ax, -m.c_dxy_N_s2_m2 * v.y() * ay, -m.c_dz_N_s2_m2 * v.z() * az};
}

}  // namespace rotorloop::host
