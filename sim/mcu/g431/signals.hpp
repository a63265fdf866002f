// The wires inside the chip, by name: what one block tells others. All are levels; a pulse is a rise and a fall at the same cycle.
#pragma once
#include <cstdint>

namespace rotorloop::mcu::g431 {

// Of every timer. ch: output at a pin; ti: input at a pin; oc: the reference of an output inside (OCxREF). crest: a pulse when the counter
// is at its top (centre-aligned) or starts again (edge-aligned).
// clang-format off
enum class TimerWire : uint16_t {
  ch1, ch2, ch3, ch4, ch1n, ch2n, ch3n, ch4n, ti1, ti2, ti3, ti4, etr, bkin, bkin2, trgo, trgo2, oc1, oc2, oc3, oc4, oc5, oc6, crest,
  input1, input2, input3, input4,  // high while the channel is an input
  count
};
enum class Signal : uint16_t {
  none = 0,
  timers = 1,                                                         // ten of them, see timer_signal
  comp1_out = timers + 10 * static_cast<uint16_t>(TimerWire::count),  // COMP1 to 4
  adc1_awd1 = comp1_out + 4,                                          // three watchdogs of ADC1, then of ADC2
  exti0 = adc1_awd1 + 6,  // an edge that EXTI line 0 to 15 takes as an event or interrupt: pulses
  usart1_tx = exti0 + 16, usart1_rx, usart2_tx, usart2_rx, usart3_tx, usart3_rx, uart4_tx, uart4_rx, lpuart1_tx, lpuart1_rx,
  fdcan1_tx, fdcan1_rx, mco,
  analogue_moved,  // a pulse: comparators look again
  pin0,  // the level at each pin as its input sees it: 16 * port + number, seven ports
  clock_failed = pin0 + 112,  // the crystal stopped: what the clock security system watches for
  count,
};
// clang-format on

inline constexpr uint32_t index(Signal s) { return static_cast<uint32_t>(s); }
inline constexpr Signal operator+(Signal s, uint32_t by) { return static_cast<Signal>(index(s) + by); }

inline constexpr uint32_t kTimers[] = {1, 2, 3, 4, 6, 7, 8, 15, 16, 17};
inline constexpr Signal timer_signal(uint32_t timer, TimerWire wire) {
  for (uint32_t n = 0; n < 10; ++n)
    if (kTimers[n] == timer) return Signal::timers + (n * static_cast<uint32_t>(TimerWire::count) + static_cast<uint32_t>(wire));
  return Signal::none;
}

}  // namespace rotorloop::mcu::g431
