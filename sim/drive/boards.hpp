// The power stages that a simulation can put behind a firmware: their true analogue scales, timing and limits. The firmware holds
// its own constants of the same boards (firmware/board/fake); the two are written down apart and compared by tests only.
#pragma once
#include <span>
#include <string_view>

#include "sim/drive/inverter.hpp"
#include "sim/drive/sensing.hpp"
#include "sim/drive/thermal.hpp"

namespace rotorloop::sim {

struct BoardStage {
  std::string_view name;
  int least_cells = 0, most_cells = 0;  // lithium-polymer in series
  double most_phase_A = 0.0;            // that the shunts can show, either sign
  double most_bus_V = 0.0;              // that the divider can show
  InverterParameters inverter{};
  SensingParameters sensing{};
  ThermalParameters thermal{};
};

// b_g431b_esc1, small_2s_15a, high_voltage_14s_120a, in this order.
std::span<const BoardStage> board_stages();
const BoardStage* find_board_stage(std::string_view name);

}  // namespace rotorloop::sim
