// What can break in one motor and its power stage, when and how much: a schedule that the drive follows by its own time.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <string_view>

namespace rotorloop::sim {

enum class DriveFaultKind : std::uint8_t {
  phase_open,      // wire of a phase off
  shunt_open,      // low side of a leg conducts no more; its amplifier goes to a rail
  shunt_short,     // the amplifier reads 0 A for ever
  high_fet_open,   // channel never on; the body diode stays
  high_fet_short,  // always on
  low_fet_open,
  low_fet_short,
  ntc_open,      // converter at the low rail: the NTC pulls up
  ntc_short,     // at the high rail
  weak_magnets,  // size: flux left, 0..1
  rotor_lock,    // held fast
  prop_strike,   // size: resisting torque, N m
  prop_loss,     // no load and no inertia of the blades
};

inline constexpr std::array<std::string_view, 13> kDriveFaultNames = {
    "phase_open", "shunt_open", "shunt_short",  "high_fet_open", "high_fet_short", "low_fet_open", "low_fet_short",
    "ntc_open",   "ntc_short",  "weak_magnets", "rotor_lock",    "prop_strike",    "prop_loss"};

struct DriveFault {
  DriveFaultKind kind = DriveFaultKind::phase_open;
  std::uint8_t phase = 0;  // 0..2, where a phase is meant
  double from_s = 0.0;     // of the drive's time
  double until_s = std::numeric_limits<double>::infinity();
  double size = 0.0;
};

// Faults of the legs, which no average over a period can show: the drive then steps every edge (switched_bridge.hpp).
struct LegFaults {
  std::array<bool, 3> phase_open{}, no_low_path{}, high_open{}, high_short{}, low_open{}, low_short{};
  bool any = false;
};

}  // namespace rotorloop::sim
