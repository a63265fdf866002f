// The ST B-G431B-ESC1: the drivers of firmware/board/g431 with the pins of pins.hpp, as the EscBoard that the program of an ESC wants.
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "firmware/app/b_g431b_esc1/memory_map.hpp"
#include "firmware/app/b_g431b_esc1/pins.hpp"
#include "firmware/board/application_board.hpp"
#include "firmware/board/fake/board_scales.hpp"
#include "firmware/board/g431/adc.hpp"
#include "firmware/board/g431/fdcan.hpp"
#include "firmware/board/g431/information.hpp"
#include "firmware/board/g431/rcc.hpp"
#include "firmware/board/g431/timer.hpp"
#include "firmware/board/g431/usart.hpp"
#include "firmware/board/g431/watchdog.hpp"

namespace rotorloop::b_g431b_esc1 {

// What did not start. The bridge then stays off, and the board says on the bus what it is as far as the bus runs.
struct StartReport {
  g431::ClockFault clocks = g431::ClockFault::none;
  g431::AdcFault adc = g431::AdcFault::none;
  bool can = true;
  bool ok() const { return clocks == g431::ClockFault::none && adc == g431::AdcFault::none && can; }
};

// The first thing after a reset, and what a fault does: all six gates are outputs of the port, low, whatever the timer does.
void hold_gates_low();

class EscBoard : public firmware::B_G431B_ESC1_Scales {
 public:
  static constexpr std::uint32_t kFlashPageBytes = g431::kPageBytes;
  static constexpr std::uint32_t kUpdateRecordPage = 2;

  // Everything after the gates, in the order of the comment in board.cpp. Interrupts stay masked.
  StartReport start();
  // Watchdog of the samples and their interrupt: from here on somebody has to answer.
  void start_sampling();

  // --- power stage, from the sample interrupt ---
  firmware::AdcCounts adc() const noexcept {
    const auto first = static_cast<std::uint16_t>(g431::adc1().jdr[0].read());
    const auto third = static_cast<std::uint16_t>(g431::adc1().jdr[1].read());
    const auto second = static_cast<std::uint16_t>(g431::adc2().jdr[0].read());
    return {{first, second, third}, static_cast<std::uint16_t>(slow_.bus * bus_scale_ >> 12u), slow_.thermistor};
  }
  std::uint16_t unloaded_counts(std::size_t phase) const noexcept {
    return phase == 1 ? static_cast<std::uint16_t>(g431::adc2().dr.read()) : (phase == 0 ? slow_.u : slow_.w);
  }
  void set_compare(firmware::PwmCompare c) noexcept {
    for (std::size_t k = 0; k < 3; ++k) g431::tim1().ccr[k].write(c.phase[k]);
  }
  void bridge_on() noexcept { g431::write_gates(g431::kAllGateBits); }
  void gates_on(std::uint8_t mask) noexcept;
  void bridge_off() noexcept { g431::bridge_off(); }
  std::uint16_t reference_counts() const noexcept { return slow_.vrefint; }
  std::uint64_t time_us() const noexcept { return clock_.now(); }

  // --- the rest, from the main loop ---
  g431::Fdcan& can() { return can_; }
  bool flash_read(std::uint32_t page, std::uint32_t offset, std::span<std::uint8_t> out) const noexcept;
  bool flash_erase(std::uint32_t page) noexcept;
  bool flash_program(std::uint32_t page, std::uint32_t offset, std::uint64_t word) noexcept;
  firmware::ResetCause reset_cause() const { return cause_; }
  void restart();
  // Only noted: the watchdog is fed by end_of_turn(), when the turn that asked for it has come round.
  void kick_watchdog() { kicked_ = true; }

  void end_of_turn();
  bool button() const { return !g431::read_pin(kButton); }
  void led(bool on) { g431::write_pin(kLed, on == kLedOnAt); }
  g431::TextOut& text() { return text_; }
  void on_can_interrupt() { can_.on_interrupt(clock_.now()); }

 private:
  void follow_reference();
  void charge_bootstrap();
  void take_cause();
  void wait_us(std::uint32_t us) const;

  // What the interrupt uses comes first: its offsets fit into the instructions.
  g431::SlowSamples slow_{};
  std::uint32_t bus_scale_ = 1u << 12u;  // of 4096: supply of the converters over 3.3 V
  g431::Microseconds clock_;
  bool kicked_ = false;
  bool booted_ = false;  // by a bootloader that has not yet been told that all is well
  firmware::ResetCause cause_ = firmware::ResetCause::unknown;
  g431::TextOut text_;
  g431::Fdcan can_;
};
static_assert(firmware::EscBoard<EscBoard>);

}  // namespace rotorloop::b_g431b_esc1
