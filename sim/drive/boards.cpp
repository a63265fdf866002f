#include "sim/drive/boards.hpp"

#include <array>

namespace rotorloop::sim {
namespace {

// ST B-G431B-ESC1 (UM2516; esc sheet in sensing.hpp): the defaults of the structures.
BoardStage b_g431b_esc1() {
  BoardStage b;
  b.name = "b_g431b_esc1";
  b.least_cells = 3;
  b.most_cells = 6;
  b.most_phase_A = 45.0;
  b.most_bus_V = 34.3;
  return b;
}

// Typical data of a class, no product: a whoop-size ESC of 30 V FETs (Rds(on) 6 mohm, 1 nF), 5 mohm shunts with a gain of 20
// around half the reference (0.1 V/A), a 12 V divider.
BoardStage small_2s_15a() {
  BoardStage b;
  b.name = "small_2s_15a";
  b.least_cells = 1;
  b.most_cells = 2;
  b.most_phase_A = 15.0;
  b.most_bus_V = 12.0;
  b.inverter = {.pwm_Hz = 48000.0,
                .dead_time_s = 300e-9,
                .diode_drop_V = 0.75,
                .switch_resistance_ohm = 8.5e-3,
                .zero_zone_A = 0.5,
                .node_capacitance_F = 0.0,
                .switching_s = 20e-9};
  b.sensing.current_V_per_A = 0.1;
  b.sensing.current_zero_V = 1.65;
  b.sensing.bus_ratio = 3.3 / 12.0;
  b.thermal.fets_J_K = 0.1;
  b.thermal.fets_K_W = 6.0;
  b.thermal.board_J_K = 3.0;
  b.thermal.board_K_W = 12.0;
  return b;
}

// Typical data of a class, no product: 100 V FETs of 1.6 mohm and 3 nF, 0.5 mohm shunts with a gain of 25 around half the
// reference (12.5 mV/A), an 80 V divider, PWM at 24 kHz for their switching losses, a heat sink.
BoardStage high_voltage_14s_120a() {
  BoardStage b;
  b.name = "high_voltage_14s_120a";
  b.least_cells = 7;
  b.most_cells = 14;
  b.most_phase_A = 120.0;
  b.most_bus_V = 80.0;
  b.inverter = {.pwm_Hz = 24000.0,
                .dead_time_s = 1000e-9,
                .diode_drop_V = 0.9,
                .switch_resistance_ohm = 1.9e-3,
                .zero_zone_A = 2.0,
                .node_capacitance_F = 0.0,
                .switching_s = 80e-9};
  b.sensing.current_V_per_A = 12.5e-3;
  b.sensing.current_zero_V = 1.65;
  b.sensing.bus_ratio = 3.3 / 80.0;
  b.thermal.fets_J_K = 3.0;
  b.thermal.fets_K_W = 0.4;
  b.thermal.board_J_K = 60.0;
  b.thermal.board_K_W = 1.0;
  return b;
}

}  // namespace

std::span<const BoardStage> board_stages() {
  static const std::array<BoardStage, 3> kStages = {b_g431b_esc1(), small_2s_15a(), high_voltage_14s_120a()};
  return kStages;
}

const BoardStage* find_board_stage(std::string_view name) {
  for (const BoardStage& b : board_stages())
    if (b.name == name) return &b;
  return nullptr;
}

}  // namespace rotorloop::sim
