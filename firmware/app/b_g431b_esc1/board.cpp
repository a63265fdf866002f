#include "firmware/app/b_g431b_esc1/board.hpp"

#include "firmware/board/g431/cortex.hpp"
#include "firmware/board/g431/opamp.hpp"
#include "firmware/board/g431/pwr.hpp"

namespace rotorloop::b_g431b_esc1 {
namespace {

// The bootstrap capacitors charge through the low sides: 10 ms, a quarter of each period, so that a rotor that turns is hardly braked.
constexpr std::uint32_t kBootstrap_us = 10'000;
constexpr std::uint16_t kBootstrapCompare = firmware::B_G431B_ESC1_Scales::kPwmTop * 3 / 4;
// The three frames of the controller on a bus that others fill; shorter than what the watchdog of the loop has left after a turn.
constexpr std::uint32_t kLastFrames_us = 20'000;
constexpr std::uint8_t kLowGates = firmware::low_gate(0) | firmware::low_gate(1) | firmware::low_gate(2);

// VREFINT's calibration was made at 3.0 V; counts are taken for those of a supply of 3.3 V.
constexpr std::uint32_t kReferenceAtNominal_per_4096 = 30 * 4096 / 33;
// Beyond 10 % it is not the supply but a reading gone wrong.
constexpr std::uint32_t kLeastScale = 4096 * 9 / 10, kMostScale = 4096 * 11 / 10;

// Feeds the watchdog of the samples from RAM while the flash works: the bridge is off then, and no interrupt comes.
#ifdef __arm__
[[gnu::section(".ccm_text"), gnu::noinline]]
#endif
void feed_while_busy() {
  g431::feed_wwdg();
}

void start_pins() {
  for (const Pin p : kAnalogPins) g431::make_analog(p);
  g431::make_output(kLed, !kLedOnAt);
  g431::make_output(kCanTermination, kCanTerminated);
  g431::make_output(kCanShutdown, kCanRunsAt);
  g431::make_input(kButton, g431::Pull::up);
  g431::make_alternate(kCanTx, kCanFunction);
  g431::make_alternate(kCanRx, kCanFunction);
  g431::make_alternate(kUartTx, kUartFunction);
}

// What opens the bridge by hardware alone: lock-up, RAM parity, flash ECC, supply, a debugger's halt.
void arm_hardware_breaks() {
  g431::rcc().apb2enr.set(g431::rcc_bits::kSyscfg);
  g431::pwr().cr2.write(g431::pwr_bits::kPvdLevel2V9 | g431::pwr_bits::kPvdOn);
  g431::syscfg().cfgr2.write(g431::syscfg_bits::kLockupBreaks | g431::syscfg_bits::kParityBreaks | g431::syscfg_bits::kPvdBreaks |
                             g431::syscfg_bits::kEccBreaks);
  g431::dbgmcu().apb2fzr.write(g431::dbgmcu_bits::kTim1Stops);
  g431::dbgmcu().apb1fzr1.write(g431::dbgmcu_bits::kWwdgStops | g431::dbgmcu_bits::kIwdgStops);
}

}  // namespace

void hold_gates_low() {
  g431::rcc().ahb2enr.set(g431::rcc_bits::kGpioA | g431::rcc_bits::kGpioB | g431::rcc_bits::kGpioC);
  for (const GatePin& g : kGates) g431::make_output(g.pin, false);
}

// The order, and why it is this one:
//  1 gates low as pins (hold_gates_low, the first call after the reset, on the reset's own 16 MHz): nothing below may go wrong with a gate
//  open 2 dead-battery pull-downs of the USB-C block off: they lie on PB4 and PB6 and are steered by PA9 and PA10, two of our gates 3 why
//  the chip was reset, before anything clears it 4 clocks: everything else counts in them. What fails stays on 16 MHz and the bridge off 5
//  watchdog of the program: from here on nothing may hang 6 time, pins, text, bus: the board can be spoken to whatever the power stage does
//  7 what opens the bridge by hardware, then the timer with the outputs off, and only then the pins from port to timer: still low
//  8 amplifiers, converters, then the counter, which triggers them
//  9 bootstrap capacitors
StartReport EscBoard::start() {
  StartReport report;
  g431::rcc().apb1enr1.set(g431::rcc_bits::kPwr);
  g431::pwr().cr3.set(g431::pwr_bits::kUcpdDeadBatteryOff);
  take_cause();
  report.clocks = g431::start_clocks();
  g431::start_iwdg();
  g431::start_microseconds();
  start_pins();
  text_.start();
  report.can = report.clocks == g431::ClockFault::none && can_.start(kCanBitRate);
  arm_hardware_breaks();
  g431::rcc().apb2enr.set(g431::rcc_bits::kTim1);
  constexpr g431::BridgeTiming kTiming{.top = kPwmTop, .periods_per_sample = kPwmPeriodsPerSample, .dead_time_ns = kDeadTime_ns};
  g431::prepare_bridge(kTiming);
  for (const GatePin& g : kGates) g431::make_alternate(g.pin, g.function);
  if (report.clocks == g431::ClockFault::none) g431::watch_crystal();
  g431::start_shunt_amplifiers();
  report.adc = g431::start_adc(kAdc, slow_);
  g431::start_bridge_timer(kTiming);
  if (report.ok()) charge_bootstrap();
  return report;
}

// A bootloader resets the chip once more before it starts us, and says what was before that.
void EscBoard::take_cause() {
  cause_ = g431::take_reset_cause();
  const firmware::Handover told = read_handover();
  booted_ = told.stage == firmware::BootStage::started;
  if (booted_) cause_ = told.cause;
}

void EscBoard::start_sampling() {
  g431::enable_interrupt(g431::kIrqTim1Break, 0);
  g431::enable_interrupt(g431::kIrqAdc12, 1);
  g431::enable_interrupt(g431::kIrqFdcan0, 2);
  g431::start_wwdg();
  g431::allow_interrupts();
}

void EscBoard::charge_bootstrap() {
  set_compare({{kBootstrapCompare, kBootstrapCompare, kBootstrapCompare}});
  wait_us(100);  // two sample periods: the compares are in force
  gates_on(kLowGates);
  wait_us(kBootstrap_us);
  bridge_off();
  set_compare({});
}

void EscBoard::wait_us(std::uint32_t us) const {
  const std::uint64_t until = clock_.now() + us;
  while (clock_.now() < until) g431::feed_iwdg();
}

void EscBoard::gates_on(std::uint8_t mask) noexcept {
  if (mask == 0) return bridge_off();
  g431::write_gates(g431::gate_bits(mask));
}

bool EscBoard::flash_read(std::uint32_t page, std::uint32_t offset, std::span<std::uint8_t> out) const noexcept {
  if (page > kUpdateRecordPage || offset > kFlashPageBytes || out.size() > kFlashPageBytes - offset) return false;
  const std::uint32_t real = page == kUpdateRecordPage ? kUpdatePage : kParameterPage + page;
  return g431::read_flash(real * kFlashPageBytes + offset, out);
}

bool EscBoard::flash_erase(std::uint32_t page) noexcept {
  if (page > kUpdateRecordPage || g431::bridge_is_on()) return false;
  g431::feed_iwdg();
  return g431::erase_page(page == kUpdateRecordPage ? kUpdatePage : kParameterPage + page, feed_while_busy);
}

bool EscBoard::flash_program(std::uint32_t page, std::uint32_t offset, std::uint64_t word) noexcept {
  if (page > kUpdateRecordPage || offset > kFlashPageBytes - 8 || g431::bridge_is_on()) return false;
  const std::uint32_t real = page == kUpdateRecordPage ? kUpdatePage : kParameterPage + page;
  return g431::program_word(real * kFlashPageBytes + offset, word, feed_while_busy);
}

void EscBoard::restart() {
  bridge_off();
  hold_gates_low();
  // The answer that announces the restart may still wait in the controller.
  for (const std::uint64_t until = clock_.now() + kLastFrames_us; !can_.all_sent() && clock_.now() < until;) {
  }
  write_handover({.stage = firmware::BootStage::restart});
  g431::synchronise();
  g431::request_reset();
#ifdef __arm__
  for (;;) {
  }
#endif
}

void EscBoard::end_of_turn() {
  clock_.keep();
  follow_reference();
  text_.poll();
  if (!kicked_) return;
  kicked_ = false;
  g431::feed_iwdg();
  if (!booted_ || clock_.now() < firmware::Handover::kHealthy_us) return;
  booted_ = false;
  write_handover({.stage = firmware::BootStage::healthy});
}

// Once in each turn; one division.
void EscBoard::follow_reference() {
  const std::uint32_t counts = slow_.vrefint;
  if (counts == 0) return;
  const std::uint32_t scale = g431::vrefint_calibration() * kReferenceAtNominal_per_4096 / counts;
  if (scale >= kLeastScale && scale <= kMostScale) bus_scale_ = scale;
}

}  // namespace rotorloop::b_g431b_esc1
