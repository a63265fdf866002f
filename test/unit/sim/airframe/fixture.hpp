// A body of round numbers and a rotor with closed-form loads: airframe tests must not depend on a blade-element model.
#pragma once
#include <array>
#include <cmath>

#include "sim/airframe/airframe.hpp"

namespace rotorloop::sim::test {

inline constexpr double kArm_m = 0.0885;
inline constexpr double kHeight_m = 0.02;
inline constexpr double kMass_kg = 0.682;

inline AirframeConfig reference_body() {
  AirframeConfig c;
  c.mass_kg = kMass_kg;
  c.inertia_kg_m2 = Eigen::Vector3d(2.41e-3, 3.42e-3, 5.22e-3).asDiagonal();
  c.drag_xy_N_s2_m2 = 0.0055;
  c.drag_z_N_s2_m2 = 0.0185;
  c.density_kg_m3 = 1.2;
  const std::array<Eigen::Vector3d, 4> hubs{Eigen::Vector3d(kArm_m, -kArm_m, kHeight_m), Eigen::Vector3d(-kArm_m, kArm_m, kHeight_m),
                                            Eigen::Vector3d(kArm_m, kArm_m, kHeight_m), Eigen::Vector3d(-kArm_m, -kArm_m, kHeight_m)};
  const std::array<int, 4> spins{1, 1, -1, -1};
  for (std::size_t i = 0; i < 4; ++i) c.rotors[i] = {hubs[i], spins[i], Eigen::Vector2d::Zero(), 9.4e-6};
  c.ground_z_m = -1e4;
  return c;
}

using FourLoads = std::array<RotorLoads, 4>;
using Four = std::array<double, 4>;

inline AirframeState at_height(double z_m) {
  AirframeState s;
  s.p_W_m = {0.0, 0.0, z_m};
  return s;
}

// Thrust k omega^2 that falls with climb, drag against the in-plane velocity, torque in proportion to thrust.
inline RotorLoads analytic_rotor(const RotorCondition& c) {
  constexpr double k_N_s2 = 1.9e-6, per_climb_s_m = 0.035, drag_s_m = 0.02, torque_m = 0.016;
  RotorLoads l;
  const double thrust_N = k_N_s2 * c.omega_rad_s * c.omega_rad_s * (1.0 - per_climb_s_m * c.v_R_m_s.z());
  l.force_R_N = {-drag_s_m * thrust_N * c.v_R_m_s.x(), -drag_s_m * thrust_N * c.v_R_m_s.y(), thrust_N};
  l.shaft_torque_N_m = torque_m * thrust_N;
  l.moment_R_N_m.z() = -c.spin * l.shaft_torque_N_m;
  return l;
}

}  // namespace rotorloop::sim::test
