#include "bench/stand/run/session_grid.hpp"

#include <fmt/format.h>

#include <cmath>

namespace rotorloop::stand_run {

using modbus::StandAxis;

std::vector<GridColumn> grid_columns(const modbus::StandSetup& s) {
  std::vector<GridColumn> c(kColumns);
  // An ESC at rest reports every 500 ms; while it turns a silence this long has stopped the run.
  for (const std::size_t k : {kOmegaColumn, kEscVoltageColumn, kEscCurrentColumn}) c[k].longest_gap_ns = 1'200'000'000;
  for (const modbus::BoundChannel& a : s.axes) {
    const auto column = column_of(a.axis);
    if (!column) continue;
    const modbus::StandDevice& d = s.buses[a.bus].devices[a.device];
    c[*column].lag_ns = std::llround(1e6 * a.lag_ms);
    if (d.profile.channels[a.channel].rate == modbus::PollRate::fast) c[*column].longest_gap_ns = std::llround(1e6 * d.stale_ms);
  }
  return c;
}

std::optional<std::size_t> column_of(StandAxis axis) {
  switch (axis) {
    case StandAxis::thrust:
      return kThrustColumn;
    case StandAxis::torque:
      return kTorqueColumn;
    case StandAxis::voltage:
      return kVoltageColumn;
    case StandAxis::current:
      return kCurrentColumn;
    case StandAxis::rotor_speed:
      return kIndependentColumn;
    case StandAxis::motor_temperature:
      return kMotorTemperatureColumn;
    default:
      return std::nullopt;
  }
}

std::string speed_ratio_text(double ratio, int esc_pole_pairs) {
  std::string out = fmt::format("the ESC says {:.3f} times the independent speed", ratio);
  for (int b = 1; b <= 12; ++b)
    if (const double a = std::round(ratio * b); a > 0.0 && std::abs(ratio * b / a - 1.0) < 0.01) {
      out += fmt::format(", {:.0f}/{}", a, b);
      break;
    }
  if (esc_pole_pairs > 0)
    if (const double pairs = std::round(ratio * esc_pole_pairs); pairs >= 1.0 && std::abs(ratio * esc_pole_pairs / pairs - 1.0) < 0.015)
      return out + fmt::format(": the ESC counts {} pole pairs, by the independent speed there are {:.0f}", esc_pole_pairs, pairs);
  return out + ": pole pairs of the ESC, or marks on the rotor, are counted wrong";
}

}  // namespace rotorloop::stand_run
