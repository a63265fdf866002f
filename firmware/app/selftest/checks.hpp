// The checks of the self-test, in the order in which they are made: the chip, the converters, the bus, the gates. Each returns what it
// found with the limits within which a board is as this firmware takes it to be.
#pragma once
#include "firmware/app/selftest/board.hpp"
#include "firmware/app/selftest/report.hpp"

namespace rotorloop::selftest {

// The supply at which the first steps are taken.
inline constexpr std::int32_t kSupply_mV = 12'000;

// --- checks.cpp ---
void check_chip(Report& report, b_g431b_esc1::StartReport start);
void check_converters(Report& report);
// Before the controller is on the bus; reported when it is.
struct CanLoop {
  std::uint32_t cycles = 0;  // from each first frame to the second
  std::int32_t frames = 0;   // that came back as they were sent
};
CanLoop loop_back();
void check_can_loop(Report& report, const CanLoop& loop);

// --- gates.cpp ---
void check_gates(Report& report);
void check_dead_time(Report& report);
void check_phases(Report& report);

// --- interrupt.cpp ---
void check_interrupt(Report& report);

void wait_us(std::uint32_t us);  // with the watchdog fed

}  // namespace rotorloop::selftest
