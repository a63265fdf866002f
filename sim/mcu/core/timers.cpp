// SysTick (B3.3) and the cycle counter of the DWT (C1.8). Both are computed from the cycle: nothing happens in between.
#include "sim/mcu/core/core.hpp"

namespace rotorloop::mcu {
namespace {

constexpr uint32_t kEnable = 1, kInterrupts = 2, kProcessorClock = 4, kCountFlag = 1u << 16;
constexpr uint32_t kTraceEnable = 1u << 24;
// The reference clock of SysTick on the STM32 is HCLK / 8 (RM0440, 10.2.1).
uint64_t divider(const SysTickState& t) { return (t.ctrl & kProcessorClock) != 0 ? 1 : 8; }
constexpr uint64_t kNever = ~uint64_t{0};

uint64_t next_zero(const SysTickState& t, uint64_t now, uint64_t counts) { return counts == 0 ? kNever : now + counts * divider(t); }
uint64_t period(const SysTickState& t) { return t.load == 0 ? 0 : uint64_t{t.load} + 1; }

bool dwt_counts(const CoreState& s) { return (s.dwt.ctrl & 1) != 0 && (s.scb.demcr & kTraceEnable) != 0; }

uint32_t cycle_count(const CoreState& s) { return dwt_counts(s) ? static_cast<uint32_t>(s.cycle - s.dwt.zero_at_cycle) : s.dwt.held; }

}  // namespace

uint64_t Core::systick_event() const { return (state.systick.ctrl & kEnable) != 0 ? state.systick.zero_at_cycle : kNever; }

void Core::service_systick() {
  SysTickState& t = state.systick;
  while ((t.ctrl & kEnable) != 0 && state.cycle >= t.zero_at_cycle) {
    t.ctrl |= kCountFlag;
    if ((t.ctrl & kInterrupts) != 0) set_pending(kSysTick);
    t.zero_at_cycle = next_zero(t, t.zero_at_cycle, period(t));
  }
}

uint32_t Core::systick_value() const {
  const SysTickState& t = state.systick;
  if ((t.ctrl & kEnable) == 0) return t.held;
  if (t.zero_at_cycle == kNever) return 0;
  const uint64_t left = (t.zero_at_cycle - state.cycle + divider(t) - 1) / divider(t);
  return left > t.load ? 0 : static_cast<uint32_t>(left);
}

void Core::set_systick(uint32_t ctrl) {
  SysTickState& t = state.systick;
  const uint32_t value = systick_value();
  t.ctrl = (t.ctrl & kCountFlag) | (ctrl & 7);
  t.held = value;
  if ((t.ctrl & kEnable) != 0) t.zero_at_cycle = next_zero(t, state.cycle, value != 0 ? value : period(t));
}

bool Core::read_timers(uint32_t address, uint32_t& value) {
  service_systick();
  switch (address) {
    case 0xE000E010:
      value = state.systick.ctrl;
      state.systick.ctrl &= ~kCountFlag;
      return true;
    case 0xE000E014:
      value = state.systick.load;
      return true;
    case 0xE000E018:
      value = systick_value();
      return true;
    case 0xE000E01C:
      value = 0;
      return true;  // CALIB: no reference value
    case 0xE0001000:
      value = state.dwt.ctrl;
      return true;
    case 0xE0001004:
      value = cycle_count(state);
      return true;
    case 0xE0001008:  // the five counters of 8 bits, not modelled: they read as stopped
    case 0xE000100C:
    case 0xE0001010:
    case 0xE0001014:
    case 0xE0001018:
      value = 0;
      return true;
    case 0xE0001FB4:
      value = 0;
      return true;  // LSR: no lock
    default:
      return false;
  }
}

bool Core::write_timers(uint32_t address, uint32_t value) {
  service_systick();
  SysTickState& t = state.systick;
  const uint32_t count = cycle_count(state);
  switch (address) {
    case 0xE000E010:
      set_systick(value);
      return true;
    case 0xE000E014:
      t.load = value & 0xFFFFFF;
      return true;
    case 0xE000E018:
      t.ctrl &= ~kCountFlag;
      t.held = 0;
      if ((t.ctrl & kEnable) != 0) t.zero_at_cycle = next_zero(t, state.cycle, period(t));
      return true;
    case 0xE000EDFC:  // DEMCR.TRCENA starts and stops the counter too
      state.scb.demcr = value & 0x010F07F1;
      state.dwt.held = count;
      state.dwt.zero_at_cycle = state.cycle - count;
      return true;
    case 0xE0001000:
      state.dwt.ctrl = (value & 0x007F1FFF) | 0x40000000;
      state.dwt.held = count;
      state.dwt.zero_at_cycle = state.cycle - count;
      return true;
    case 0xE0001004:
      state.dwt.held = value;
      state.dwt.zero_at_cycle = state.cycle - value;
      return true;
    case 0xE0001008:
    case 0xE000100C:
    case 0xE0001010:
    case 0xE0001014:
    case 0xE0001018:
    case 0xE0001FB0:
      return true;
    default:
      return false;
  }
}

}  // namespace rotorloop::mcu
