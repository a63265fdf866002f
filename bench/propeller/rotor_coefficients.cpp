#include "bench/propeller/rotor_coefficients.hpp"

#include <cmath>
#include <numbers>

namespace rotorloop::propeller {

RotorCoefficients rotor_coefficients(const sim::RotorLoads& loads, const sim::RotorCondition& condition, double radius_m) {
  const double n_Hz = condition.omega_rad_s / (2 * std::numbers::pi), diameter_m = 2 * radius_m;
  const double force_N = condition.density_kg_m3 * n_Hz * n_Hz * std::pow(diameter_m, 4), moment_N_m = force_N * diameter_m;
  Eigen::Vector2d along = condition.v_R_m_s.head<2>();
  along = along.norm() > 0 ? Eigen::Vector2d(along.normalized()) : Eigen::Vector2d::UnitX();
  const Eigen::Vector2d left(-along.y(), along.x());
  RotorCoefficients c;
  c.c_t = loads.force_R_N.z() / force_N;
  c.c_p = loads.shaft_torque_N_m * condition.omega_rad_s / (moment_N_m * n_Hz);
  c.c_h = -loads.force_R_N.head<2>().dot(along) / force_N;
  c.c_pitch = loads.moment_R_N_m.head<2>().dot(left) / moment_N_m;
  c.c_roll = loads.moment_R_N_m.head<2>().dot(along) / moment_N_m;
  const double j = advance_ratio(condition, radius_m);
  c.eta = j >= 0 && c.c_t > 0 && c.c_p > 0 ? j * c.c_t / c.c_p : std::nan("");
  return c;
}

double advance_ratio(const sim::RotorCondition& condition, double radius_m) {
  return std::numbers::pi * condition.v_R_m_s.z() / (condition.omega_rad_s * radius_m);
}

double edgewise_advance_ratio(const sim::RotorCondition& condition, double radius_m) {
  return condition.v_R_m_s.head<2>().norm() / (condition.omega_rad_s * radius_m);
}

double figure_of_merit(const sim::RotorLoads& loads, const sim::RotorCondition& condition, double radius_m) {
  const double thrust_N = loads.force_R_N.z(), area_m2 = std::numbers::pi * radius_m * radius_m;
  const double ideal_W = thrust_N * std::sqrt(thrust_N / (2 * condition.density_kg_m3 * area_m2));
  return ideal_W / (loads.shaft_torque_N_m * condition.omega_rad_s);
}

}  // namespace rotorloop::propeller
