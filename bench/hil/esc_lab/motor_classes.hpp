// Motor classes of the laboratory and what is drawn for one trial: a motor, a board, a supply, and what was written into the ESC.
// Every number is typical data of its class, no data sheet.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "firmware/core/interface.hpp"
#include "sim/drive/drive.hpp"
#include "sim/esc/native_esc.hpp"

namespace rotorloop::esc_lab {

enum class LabBoard : std::uint8_t { b_g431b_esc1, small, high_voltage };

struct MotorClass {
  std::string_view name;
  LabBoard board;
  int cells;
  double kv_rpm_V;
  int pole_pairs;
  double resistance_ohm, inductance_H;  // one phase
  double rotor_inertia_kg_m2, blade_inertia_kg_m2;
  double load_N_m_s2;  // propeller torque / speed²
  double static_friction_N_m, cogging_N_m;
  double phase_limit_A;
  double start_within_ms;
};

std::span<const MotorClass> motor_classes();
const MotorClass* find_motor_class(std::string_view name);

enum class Knowledge : std::uint8_t { data_sheet, commissioned };

struct EscDraw {
  std::string motor_class;  // by its propeller
  LabBoard board = LabBoard::b_g431b_esc1;
  double start_within_ms = 0.0;
  int cells = 0;
  std::uint64_t seed = 0;
  sim::DriveParameters drive{};  // motor as drawn; the board draws itself (NativeEscConfig::typical_board)
  double load_N_m_s2 = 0.0;
  double bus_V = 0.0;
  firmware::Parameters firmware{};
};

// R, L, flux each within ±20 % of the class, inertia ±30 %, friction and cogging half to twice; 3.5 V per cell on odd seeds, 4.2 on
// even ones (gimbal: three cells on every other pair). data_sheet: the ESC has the class's numbers. commissioned: the true ones with
// errors of R, L and flux within ±5 %, inertia ±8 %, as large as a commissioning may leave.
EscDraw draw_esc(const MotorClass& c, std::uint64_t seed, Knowledge knowledge);

// Calls f.template operator()<Esc>() with the ESC of that board.
template <class F>
decltype(auto) with_esc_of(LabBoard board, const F& f) {
  switch (board) {
    case LabBoard::small:
      return f.template operator()<sim::SmallNativeEsc>();
    case LabBoard::high_voltage:
      return f.template operator()<sim::HighVoltageNativeEsc>();
    case LabBoard::b_g431b_esc1:
      break;
  }
  return f.template operator()<sim::NativeEsc>();
}

// Which class trial `index` (from 0) of `trials` flies: each class in turn until each has a fifteenth of all, then 5-inch.
const MotorClass& class_of_trial(std::uint64_t index, std::uint64_t trials);

}  // namespace rotorloop::esc_lab
