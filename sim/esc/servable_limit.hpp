// Which phase current limit an ESC can serve: a number of its firmware (decision 0174), asked before anything flies.
#pragma once
#include <string>
#include <string_view>

#include "sim/drive/boards.hpp"

namespace rotorloop::sim {

// Of a power stage, a motor's phase inductance and a bus voltage.
struct ServableLimit {
  std::string_view stage;
  double inductance_H = 0.0, bus_V = 0.0;
  double limit_A = 0.0;  // the largest phase_current_limit_A that is served in full
  int rotor = 0;         // 1 to 4: whose ESC it is, where those of a vehicle differ
};

inline constexpr double kFullCell_V = 4.2;  // of lithium polymer: a full battery allows the least

// Throws Error for a stage that no firmware of this repository drives.
ServableLimit servable_limit(const BoardStage& stage, double inductance_H, double bus_V);

// "33.4 A with 6.5 uH at 25.2 V on b_g431b_esc1", rounded down; where the ESCs differ, "… (rotor 3)".
std::string servable_text(const ServableLimit& limit);

// Throws Error (exit 2) with the number that can be served when `asked_A` is more. `where`: file or empty; `what`: key or option.
void check_servable(const ServableLimit& limit, double asked_A, const std::string& where, const std::string& what);

}  // namespace rotorloop::sim
