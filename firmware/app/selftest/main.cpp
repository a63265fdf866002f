// The image for the first power-up of an ST B-G431B-ESC1, without a motor (docs/first_power.md): what is true of this board, a line for
// each check. It starts the board as the product does, by the product's own code, and never turns a motor.
#include "firmware/app/b_g431b_esc1/faults.hpp"
#include "firmware/app/selftest/checks.hpp"
#include "firmware/board/g431/cortex.hpp"

namespace rotorloop::selftest {

constinit QuietEscBoard the_board;

namespace {

// Between two NodeStatus.
constexpr std::uint32_t kStatus_us = 1'000'000;

// A frame that another node has acknowledged.
void check_bus(Report& report, bool runs) {
  if (runs) the_board.can().start(b_g431b_esc1::kCanBitRate);
  report.tell_status();
  wait_us(10'000);
  report.tell({"can_acknowledged", runs && the_board.can().all_sent() ? 1 : 0, 1, 1, "frame"});
}

void run(Report& report, b_g431b_esc1::StartReport start) {
  const CanLoop loop = start.can ? loop_back() : CanLoop{};
  check_bus(report, start.can);
  check_chip(report, start);
  check_can_loop(report, loop);
  check_converters(report);
  check_gates(report);
  check_dead_time(report);
  check_phases(report);
  check_interrupt(report);
  report.tell_failed();
  the_board.led(report.failed() == 0);
}

}  // namespace
}  // namespace rotorloop::selftest

extern "C" {

int main();
void can_interrupt();

void can_interrupt() { rotorloop::selftest::the_board.on_can_interrupt(); }

int main() {
  using namespace rotorloop;
  using namespace rotorloop::selftest;
  const b_g431b_esc1::StartReport start = the_board.start();
  // Without the crystal's clock the serial line alone is left: at its rate, so that it can be read.
  if (start.clocks != g431::ClockFault::none) g431::usart2().brr.write(g431::kAfterReset_Hz / g431::kUart_Bd);
  g431::count_cycles();
  Report report;
  if (const b_g431b_esc1::FaultRecord fault = b_g431b_esc1::take_fault_record(); fault.magic != 0)
    report.tell({"exception", static_cast<std::int32_t>(fault.exception), 0, 0, "number"});
  run(report, start);
  for (;;) {
    wait_us(kStatus_us);
    report.tell_status();
  }
}

}  // extern "C"
