// Calibration of load cells with known loads: readings s = A L + s0 over load cases, turned round to loads L = C (s - s0). A cell for
// thrust feels torque too and the other way round; the matrix takes that out, as far as the cases show it.
#pragma once
#include <array>
#include <string>
#include <vector>

namespace rotorloop::modbus {

struct LoadCase {
  std::array<double, 2> load{};     // thrust in N, torque in N m
  std::array<double, 2> reading{};  // of the two channels, in their units
};

struct LoadCalibration {
  std::array<std::array<double, 2>, 2> matrix{};  // C: load per reading
  std::array<double, 2> zero{};                   // s0: reading without load
  // Of each axis, in its unit: what the matrix leaves of the known loads.
  std::array<double, 2> residual_sd{}, residual_max{};
  std::array<double, 2> full_scale{};
  // What the uncorrected channel of axis i shows at full scale of the other axis, in percent of its own full scale.
  std::array<double, 2> cross_talk_percent{};
  double cross_talk_u_m = 0.0;  // standard uncertainty of the torque that a newton of thrust is taken to make, N m per N
  double condition = 1.0;       // of the matrix, with both axes scaled to full scale: 1 is two independent cells
  std::array<double, 2> load_of(const std::array<double, 2>& reading) const;
};

inline constexpr std::size_t kLeastLoadCases = 6;

// `problem` is empty, or says why the cases give no calibration: too few, an axis never loaded, loads that always go together.
LoadCalibration fit_calibration(const std::vector<LoadCase>& cases, const std::array<double, 2>& full_scale, std::string& problem);

}  // namespace rotorloop::modbus
