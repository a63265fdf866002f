#include "host/control/thrust_table.hpp"

#include <algorithm>
#include <cmath>

#include "host/vehicle/thrust.hpp"

namespace rotorloop::host {

namespace {
constexpr double kAxialStep_m = 2.0 * ThrustTable::kAxialMax_m / static_cast<double>(ThrustTable::kAxialNodes - 1);
constexpr double kCrossStep_m = ThrustTable::kCrossMax_m / static_cast<double>(ThrustTable::kCrossNodes - 1);
constexpr double kReference_rad_s = 1000.0;  // any speed: c_t depends on the ratios alone
}  // namespace

ThrustTable::ThrustTable(const ThrustModel& model, ThrustLookup lookup) : still_air_(static_c_t(model)), lookup_(lookup) {
  for (std::size_t row = 0; row < kCrossNodes; ++row)
    for (std::size_t column = 0; column < kAxialNodes; ++column) {
      const double axial_m = -kAxialMax_m + kAxialStep_m * static_cast<double>(column);
      const double cross_m = lookup == ThrustLookup::full ? kCrossStep_m * static_cast<double>(row) : 0.0;
      c_t_N_s2_[row][column] = solve_thrust(model, kReference_rad_s, axial_m * kReference_rad_s, cross_m * kReference_rad_s).c_t_N_s2;
    }
}

ThrustTable::Value ThrustTable::at(double omega_rad_s, double v_z_m_s, double v_xy_m_s) const {
  if (lookup_ == ThrustLookup::still_air) return {still_air_, still_air_, false};
  const double axial_m = v_z_m_s / omega_rad_s, cross_m = lookup_ == ThrustLookup::full ? v_xy_m_s / omega_rad_s : 0.0;
  const double axial = std::clamp(axial_m, -kAxialMax_m, kAxialMax_m), cross = std::clamp(cross_m, 0.0, kCrossMax_m);
  bool at_edge = axial != axial_m || cross != cross_m;

  const double x = (axial + kAxialMax_m) / kAxialStep_m, y = cross / kCrossStep_m;
  const auto column = std::min(static_cast<std::size_t>(x), kAxialNodes - 2);
  const auto row = std::min(static_cast<std::size_t>(y), kCrossNodes - 2);
  const double fx = x - static_cast<double>(column), fy = y - static_cast<double>(row);
  const double c00 = c_t_N_s2_[row][column], c01 = c_t_N_s2_[row][column + 1];
  const double c10 = c_t_N_s2_[row + 1][column], c11 = c_t_N_s2_[row + 1][column + 1];
  const double c_t = (1 - fy) * ((1 - fx) * c00 + fx * c01) + fy * ((1 - fx) * c10 + fx * c11);
  if (c_t < kFloor * still_air_) return {kFloor * still_air_, kFloor * still_air_, true};
  // d/d(ω²) of c_t(a/ω, b/ω) ω²: every ratio shrinks with half the relative rate at which ω² grows.
  const double per_axial = ((1 - fy) * (c01 - c00) + fy * (c11 - c10)) / kAxialStep_m;
  const double per_cross = ((1 - fx) * (c10 - c00) + fx * (c11 - c01)) / kCrossStep_m;
  const double slope = at_edge ? c_t : c_t - 0.5 * (per_axial * axial + per_cross * cross);
  return {c_t, std::max(slope, kFloor * still_air_), at_edge};
}

}  // namespace rotorloop::host
