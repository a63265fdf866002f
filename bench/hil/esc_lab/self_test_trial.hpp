// One power-up of a drawn ESC with a bridge that is sound or broken: what its self-test says, and what it costs the motor.
#pragma once
#include <optional>
#include <span>

#include "bench/hil/esc_lab/motor_classes.hpp"

namespace rotorloop::esc_lab {

// The motor classes, and one of a board of two cells.
std::span<const MotorClass> self_test_classes();
EscDraw draw_for_self_test(const MotorClass& c, std::uint64_t seed);

struct BridgeFault {
  firmware::Broken what = firmware::Broken::phase_open;
  std::uint8_t leg = 0;
};
// Six FETs open, six short, three phases open.
std::span<const BridgeFault> bridge_faults();

struct SelfTestOutcome {
  firmware::SelfTest result = firmware::SelfTest::due;
  firmware::Broken broken = firmware::Broken::none;
  std::uint8_t leg = 0;
  double ms = 0.0;                 // from the first gate to the end, or all the time allowed
  double peak_A = 0.0;             // largest phase current of the motor
  double supply_shorted_us = 0.0;  // both FETs of a leg conducting
  double turned_deg = 0.0;         // electrical, the most from where the rotor stood
  bool driven_afterwards = false;  // an order that follows the finding closes a gate
};

struct SelfTestConditions {
  std::optional<BridgeFault> fault;
  double omega_rad_s = 0.0;  // of the rotor at power-up
};

SelfTestOutcome run_self_test(const EscDraw& d, const SelfTestConditions& conditions);

inline bool named_rightly(const SelfTestOutcome& o, const BridgeFault& f) {
  return o.result == firmware::SelfTest::failed && o.broken == f.what && o.leg == f.leg && !o.driven_afterwards;
}

}  // namespace rotorloop::esc_lab
