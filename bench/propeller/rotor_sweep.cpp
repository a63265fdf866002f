#include "bench/propeller/rotor_sweep.hpp"

#include <cmath>
#include <numbers>

namespace rotorloop::propeller {
namespace {
sim::RotorCondition with_velocity(sim::RotorCondition base, const Eigen::Vector3d& v_R_m_s) {
  base.v_R_m_s = v_R_m_s;
  base.w_R_rad_s.setZero();
  return base;
}

SweepPoint point_after(const sim::Rotor& rotor, const sim::RotorCondition& condition, sim::RotorWarmStart& before) {
  const sim::RotorLoads loads = sim::solve_rotor(rotor, condition, before);
  return {condition, loads, rotor_coefficients(loads, condition, rotor.radius_m())};
}
}  // namespace

SweepPoint rotor_point(const sim::Rotor& rotor, const sim::RotorCondition& condition) {
  sim::RotorWarmStart cold;
  return point_after(rotor, condition, cold);
}

std::vector<SweepPoint> advance_sweep(const sim::Rotor& rotor, const sim::RotorCondition& base, double step) {
  const double per_advance_m_s = base.omega_rad_s * rotor.radius_m() / std::numbers::pi;
  std::vector<SweepPoint> points;
  for (int i = 0; i * step <= kMostAdvance; ++i) {
    points.push_back(rotor_point(rotor, with_velocity(base, {0, 0, i * step * per_advance_m_s})));
    if (points.back().coefficients.c_t < 0) break;
  }
  return points;
}

std::vector<SweepPoint> edgewise_sweep(const sim::Rotor& rotor, const sim::RotorCondition& base, double climb_angle_rad, double mu_most,
                                       int points) {
  std::vector<SweepPoint> out;
  for (int i = 0; i < points; ++i) {
    const double edgewise_m_s = mu_most * i / (points - 1) * base.omega_rad_s * rotor.radius_m();
    out.push_back(rotor_point(rotor, with_velocity(base, {edgewise_m_s, 0, edgewise_m_s * std::tan(climb_angle_rad)})));
  }
  return out;
}

std::vector<SweepPoint> climb_sweep(const sim::Rotor& rotor, const sim::RotorCondition& base, double from_m_s, double to_m_s, int points) {
  std::vector<SweepPoint> out;
  sim::RotorWarmStart before;
  for (int i = 0; i < points; ++i) {
    const double climb_m_s = from_m_s + (to_m_s - from_m_s) * i / (points - 1);
    out.push_back(point_after(rotor, with_velocity(base, {0, 0, climb_m_s}), before));
  }
  return out;
}

double momentum_theory_induced_m_s(double thrust_N, double climb_m_s, double density_kg_m3, double disk_area_m2) {
  if (!(thrust_N > 0)) return std::nan("");
  const double hover2 = thrust_N / (2 * density_kg_m3 * disk_area_m2), hover = std::sqrt(hover2), half = climb_m_s / 2;
  if (climb_m_s >= 0) return -half + std::sqrt(half * half + hover2);
  if (climb_m_s <= -2 * hover) return -half - std::sqrt(half * half - hover2);
  return std::nan("");
}

}  // namespace rotorloop::propeller
