// Columns of a run's rows, and what is judged row by row.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/sample_grid.hpp"

namespace rotorloop::stand_run {

inline constexpr std::size_t kOmegaColumn = 0, kThrustColumn = 1, kTorqueColumn = 2, kVoltageColumn = 3, kCurrentColumn = 4,
                             kIndependentColumn = 5, kEscVoltageColumn = 6, kEscCurrentColumn = 7, kEscTemperatureColumn = 8,
                             kMotorTemperatureColumn = 9, kDutyColumn = 10, kColumns = 11;
inline constexpr std::int64_t kGrid_ns = 10'000'000;       // 100 Hz, as readings of two or three instruments on a bus come
inline constexpr std::int64_t kPatience_ns = 700'000'000;  // an ESC at rest reports every 500 ms
inline constexpr std::int64_t kHistory_ns = 2'000'000'000;
inline constexpr double kSpeedsDiffer = 0.03;  // between ESC and independent speed: both are good to 0.1 %
inline constexpr std::int64_t kSpeedsDiffer_ns = 300'000'000;

std::vector<GridColumn> grid_columns(const modbus::StandSetup& setup);
std::optional<std::size_t> column_of(modbus::StandAxis axis);
// "the ESC says 1.167 times the independent speed: … 7 pole pairs, not 6".
std::string speed_ratio_text(double ratio, int esc_pole_pairs);

}  // namespace rotorloop::stand_run
