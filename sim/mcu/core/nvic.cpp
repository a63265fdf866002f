// Which exception comes next: priorities, pending and lines (B1.5.4, B3.4), waking from sleep, and faults with their escalation.
#include <algorithm>
#include <bit>

#include "sim/mcu/core/core.hpp"

namespace rotorloop::mcu {

int Core::priority_of(uint32_t exception) const {
  switch (exception) {
    case kReset:
      return -3;
    case kNmi:
      return -2;
    case kHardFault:
      return -1;
    default:
      return state.nvic.priority[exception];
  }
}

// The part of a priority that decides about preemption; the rest only orders what is pending.
int Core::group_priority(int priority) const {
  if (priority < 0) return priority;
  return priority & static_cast<int>(0xFFu << (state.scb.aircr_prigroup + 1));
}

int Core::execution_priority() const {
  int priority = 256;
  for (uint32_t word = 0; word < 2; ++word) {
    for (uint64_t bits = state.nvic.active.words[word]; bits != 0; bits &= bits - 1) {
      const uint32_t n = 64 * word + static_cast<uint32_t>(std::countr_zero(bits));
      priority = std::min(priority, group_priority(priority_of(n)));
    }
  }
  if (state.basepri != 0) priority = std::min(priority, group_priority(static_cast<int>(state.basepri)));
  if (state.primask != 0) priority = std::min(priority, 0);
  if (state.faultmask != 0) priority = std::min(priority, -1);
  return priority;
}

uint32_t Core::best_pending() const {
  uint32_t best = 0;
  for (uint32_t word = 0; word < 2; ++word) {
    for (uint64_t bits = state.nvic.pending.words[word] & state.nvic.enabled.words[word]; bits != 0; bits &= bits - 1) {
      const uint32_t n = 64 * word + static_cast<uint32_t>(std::countr_zero(bits));
      if (best == 0 || priority_of(n) < priority_of(best)) best = n;
    }
  }
  return best;
}

bool Core::can_preempt(uint32_t exception) const { return exception != 0 && group_priority(priority_of(exception)) < execution_priority(); }

bool Core::take_pending() {
  const uint32_t best = best_pending();
  if (!can_preempt(best)) return false;
  state.phase_exception = best;
  begin_entry();
  return true;
}

// WFI wakes for what would preempt were PRIMASK clear; WFE for that and for an event.
bool Core::wakes() const {
  if (state.sleeping_for_event && state.event) return true;
  const uint32_t best = best_pending();
  if (best == 0) return false;
  int priority = 256;
  for (uint32_t n = 1; n < kExceptions; ++n)
    if (state.nvic.active.has(n)) priority = std::min(priority, group_priority(priority_of(n)));
  if (state.basepri != 0) priority = std::min(priority, group_priority(static_cast<int>(state.basepri)));
  if (state.faultmask != 0) priority = std::min(priority, -1);
  return group_priority(priority_of(best)) < priority;
}

void Core::set_pending(uint32_t exception) {
  if (!state.nvic.pending.has(exception) && (state.scb.scr & 0x10) != 0) state.event = true;  // SEVONPEND
  state.nvic.pending.set(exception, true);
  look_again();
}

void Core::set_interrupt_line(uint32_t interrupt, bool high) {
  const uint32_t n = kFirstInterrupt + interrupt;
  const bool was = state.nvic.line.has(n);
  state.nvic.line.set(n, high);
  if (high && !was) set_pending(n);
}

// --- faults ---------------------------------------------------------------------------------------------------------------

// The exception that a fault becomes: itself, or HardFault where it is disabled or not urgent enough; in HardFault and NMI the core locks
// up.
uint32_t Core::fault_taken(uint32_t exception) {
  if (state.nvic.enabled.has(exception) && can_preempt(exception)) return exception;
  state.scb.hfsr |= 1u << 30;  // FORCED
  if (execution_priority() <= -1) lock_up();
  return kHardFault;
}

void Core::lock_up() {
  state.locked_up = true;
  look_again();
}

void Core::take_synchronous(uint32_t exception, uint32_t return_address, uint32_t it) {
  state.r[kPc] = return_address;
  set_it(it);
  const uint32_t taken = fault_taken(exception);
  if (state.locked_up) return;
  state.nvic.pending.set(taken, true);
  state.phase_exception = taken;
  begin_entry();
}

namespace {
uint32_t it_of(const CoreState& s, const Op& op) { return (op.tag & kTagInIt) != 0 ? s.it_of_instruction : 0; }
}  // namespace

void Core::usage_fault(const Op& op, uint32_t cfsr_bit) {
  state.scb.cfsr |= cfsr_bit;
  take_synchronous(kUsageFault, state.r[kPc] - op.bytes, it_of(state, op));
}

void Core::memory_fault(const Op& op, uint32_t address, Access kind) {
  if (kind == Access::fetch) {
    state.scb.cfsr |= 1;  // IACCVIOL
  } else {
    state.scb.cfsr |= 0x82;  // DACCVIOL, MMARVALID
    state.scb.mmfar = address;
  }
  take_synchronous(kMemManage, state.r[kPc] - op.bytes, it_of(state, op));
}

void Core::bus_fault(const Op& op, uint32_t address, Access kind) {
  if (kind == Access::fetch) {
    state.scb.cfsr |= 1u << 8;  // IBUSERR
  } else {
    state.scb.cfsr |= 0x8200;  // PRECISERR, BFARVALID
    state.scb.bfar = address;
  }
  take_synchronous(kBusFault, state.r[kPc] - op.bytes, it_of(state, op));
}

void Core::pend_imprecise_bus_fault() {
  state.scb.cfsr |= 1u << 10;  // IMPRECISERR
  if (state.nvic.enabled.has(kBusFault)) {
    set_pending(kBusFault);
    return;
  }
  state.scb.hfsr |= 1u << 30;
  set_pending(kHardFault);
}

// BKPT: a debugger stops; without one the debug monitor takes it, or it is a HardFault (C1.3).
void Core::breakpoint(const Op& op) {
  const uint32_t here = state.r[kPc] - op.bytes;
  if (stop_at_breakpoints_) {
    state.r[kPc] = here;
    set_it(it_of(state, op));
    state.at_breakpoint = true;
    look_again();
    return;
  }
  state.scb.dfsr |= 2;  // BKPT
  if ((state.scb.demcr & 1u << 16) != 0 && can_preempt(kDebugMonitor)) {
    take_synchronous(kDebugMonitor, here, it_of(state, op));
    return;
  }
  state.scb.hfsr |= 1u << 31;  // DEBUGEVT
  if (execution_priority() <= -1) {
    state.r[kPc] = here;
    lock_up();
    return;
  }
  take_synchronous(kHardFault, here, it_of(state, op));
}

}  // namespace rotorloop::mcu
