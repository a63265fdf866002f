// c_t ahead of time: eq. (1)-(2) are solved on a grid at set-up, because solving them per rotor and step costs too much.
// Dividing both equations by ω² leaves only the ratios v_z/ω and v_xy/ω (decision 0040), so a two-dimensional table holds
// c_t(v_z, v_xy, ω) exactly; the paper's c_t(v_z, ω) is its row v_xy = 0. The table lives inside its owner: no heap.
#pragma once
#include <array>
#include <cstddef>

#include "host/vehicle/model.hpp"

namespace rotorloop::host {

enum class ThrustLookup : std::uint8_t {
  still_air,  // c_t of hover, always
  axial,      // c_t(v_z, ω), as in the paper
  full,       // c_t(v_z, v_xy, ω)
};

class ThrustTable {
 public:
  // Ratios in m/rad. At hover speed (940 rad/s) ±0.03 is ±28 m/s along the axis, 0.048 is 45 m/s across.
  // The spacing keeps interpolation within 0.1 % (24 kB).
  static constexpr double kAxialMax_m = 0.030, kCrossMax_m = 0.048;
  static constexpr std::size_t kAxialNodes = 61, kCrossNodes = 49;
  // The least c_t, as a share of the one in still air: beyond it a demand for thrust would ask for endless speed.
  static constexpr double kFloor = 0.10;

  ThrustTable(const ThrustModel& model, ThrustLookup lookup);

  struct Value {
    double c_t_N_s2;
    double slope_N_s2;  // dT / d(ω²) at constant velocity: c_t plus what changing the ratios does to it
    bool at_edge;       // outside the table or at the floor: clamped
  };
  Value at(double omega_rad_s, double v_z_m_s, double v_xy_m_s) const;
  double still_air_c_t_N_s2() const { return still_air_; }

 private:
  double still_air_;
  ThrustLookup lookup_;
  std::array<std::array<double, kAxialNodes>, kCrossNodes> c_t_N_s2_{};
};

}  // namespace rotorloop::host
