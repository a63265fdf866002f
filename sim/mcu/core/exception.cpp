// Entry into exceptions and return from them (B1.5): frames, late arrival, tail-chaining, lazy saving of floating-point registers.
// Entry and return take time in which the caller's peripherals go on: an exception that arrives meanwhile may still be the one taken.
#include <bit>
#include <utility>

#include "sim/mcu/core/core.hpp"
#include "sim/mcu/core/costs.hpp"

namespace rotorloop::mcu {
namespace {

constexpr uint32_t kFrameBytes = 0x20, kFpFrameBytes = 0x68;
constexpr uint32_t kLazyPending = 1, kLazyEnabled = 1u << 30;
// Results of an access to the stack, as the bits of CFSR that tell of it less their name: bus error, MPU.
constexpr uint32_t kStackOk = 0, kStackBus = 1, kStackMpu = 2;

}  // namespace

uint32_t Core::stack_access(uint32_t address, uint32_t& value, bool write, bool as_privileged) {
  if (!mpu_allows(address, write ? Access::write : Access::read, as_privileged)) return kStackMpu;
  return raw_access(address, 4, value, write) ? kStackOk : kStackBus;
}

uint32_t Core::push_fp(uint32_t frame, bool as_privileged) {
  uint32_t failed = kStackOk;
  for (uint32_t i = 0; i < 16; ++i) failed |= stack_access(frame + 4 * i, state.s[i], true, as_privileged);
  return failed | stack_access(frame + 64, state.fpscr, true, as_privileged);
}

// PushStack. What fails is a fault that comes with this entry: it is pended and competes with what was to be taken.
void Core::push_frame() {
  const bool fp = (state.control & 4) != 0, as_privileged = privileged(), aligns = fp || (state.scb.ccr & 0x200) != 0;
  const uint32_t sp = state.r[kSp], frame = (sp - (fp ? kFpFrameBytes : kFrameBytes)) & (aligns ? ~4u : ~0u);
  std::array<uint32_t, 8> words = {state.r[0],  state.r[1],   state.r[2],   state.r[3],
                                   state.r[12], state.r[kLr], state.r[kPc], xpsr() | (aligns && (sp & 4) != 0 ? 0x200u : 0)};
  uint32_t failed = kStackOk;
  for (uint32_t i = 0; i < 8; ++i) failed |= stack_access(frame + 4 * i, words[i], true, as_privileged);
  if (fp && (state.scb.fpccr & kLazyEnabled) == 0) failed |= push_fp(frame + kFrameBytes, as_privileged);
  if (fp && (state.scb.fpccr & kLazyEnabled) != 0) {
    state.scb.fpcar = frame + kFrameBytes;
    state.scb.fpccr = (state.scb.fpccr & 0xC0000000u) | kLazyPending | (as_privileged ? 0 : 2) | (state.ipsr == 0 ? 8 : 0);
  }
  state.r[kSp] = frame;
  if ((failed & kStackBus) != 0) state.scb.cfsr |= 1u << 12;  // STKERR
  if ((failed & kStackMpu) != 0) state.scb.cfsr |= 1u << 4;   // MSTKERR
  if (failed != kStackOk) state.nvic.pending.set(fault_taken((failed & kStackBus) != 0 ? kBusFault : kMemManage), true);
}

void Core::begin_entry() {
  const bool fp = (state.control & 4) != 0;
  const uint32_t exc_return = 0xFFFFFFE1u | (state.ipsr == 0 ? 8u : 0) | (uses_psp() ? 4u : 0) | (fp ? 0 : 0x10u);
  push_frame();
  if (uses_psp()) std::swap(state.r[kSp], state.other_sp);
  state.control &= ~6u;
  state.exc_return = exc_return;
  state.sleeping = false;
  state.event = true;
  state.exclusive = false;
  state.phase = Phase::stacking;
  state.phase_end_cycle = state.cycle + cost::kEntry + (fp && (state.scb.fpccr & kLazyEnabled) == 0 ? cost::kFpFrame : 0);
  look_again();
}

// The vector is chosen when stacking is done: a more urgent exception that came meanwhile is taken instead (late arrival).
void Core::end_entry() {
  const uint32_t best = best_pending();
  enter_vector(best != 0 ? best : state.phase_exception, state.exc_return);
}

void Core::enter_vector(uint32_t exception, uint32_t exc_return) {
  state.phase = Phase::running;
  uint32_t vector = 0;
  if (!read_vector(state.scb.vtor + 4 * exception, vector)) {
    state.scb.hfsr |= 2;  // VECTTBL
    if (exception == kHardFault || exception == kNmi) {
      lock_up();
      return;
    }
    enter_vector(kHardFault, exc_return);
    return;
  }
  state.nvic.pending.set(exception, false);
  state.nvic.active.set(exception, true);
  state.ipsr = exception;
  state.served[exception].begun_cycle = state.cycle;
  state.served[exception].begun_waits = state.flash_waits;
  state.r[kLr] = exc_return;
  state.it = 0;
  state.r[kPc] = vector & ~1u;
  state.thumb = vector & 1;
  update_context();
  look_again();
}

void Core::tail_chain(uint32_t exc_return) {
  state.exc_return = exc_return;
  state.phase = Phase::stacking;
  state.phase_end_cycle = state.cycle + cost::kTailChain;
  look_again();
}

void Core::deactivate(uint32_t exception) {
  state.nvic.active.set(exception, false);
  if (exception != kNmi) state.faultmask = 0;
  if (exception >= kFirstInterrupt && state.nvic.line.has(exception)) set_pending(exception);
}

// Integrity checks of an EXC_RETURN value (B1.5.8).
bool Core::valid_return(uint32_t exc_return) const {
  const uint32_t how = exc_return & 15;
  const uint32_t active = static_cast<uint32_t>(std::popcount(state.nvic.active.words[0]) + std::popcount(state.nvic.active.words[1]));
  if (!state.nvic.active.has(state.ipsr) || (exc_return & 0x0FFFFFE0u) != 0x0FFFFFE0u) return false;
  if (how == 1) return active > 1;
  return (how == 9 || how == 13) && (active == 1 || (state.scb.ccr & 1) != 0);
}

void Core::begin_return(const Op&, uint32_t exc_return) {
  const bool valid = valid_return(exc_return);
  Served& served = state.served[state.ipsr & (kExceptions - 1)];
  const uint64_t cycles = state.cycle - served.begun_cycle, waits = state.flash_waits - served.begun_waits;
  ++served.count;
  served.cycles += cycles;
  served.waits += waits;
  if (cycles > served.longest_cycles) {
    served.longest_cycles = cycles;
    served.longest_waits = waits;
  }
  deactivate(state.ipsr);
  state.exclusive = false;
  state.event = true;
  if (!valid) {
    state.scb.cfsr |= 1u << 18;  // INVPC
    state.phase_exception = fault_taken(kUsageFault);
    state.nvic.pending.set(state.phase_exception, true);
    if (!state.locked_up) tail_chain(exc_return | 0xF0000000u);
    return;
  }
  state.exc_return = exc_return;
  state.phase = Phase::unstacking;
  state.phase_end_cycle = state.cycle + cost::kReturn - cost::kRefill +
                          ((exc_return & 0x10) == 0 && (state.scb.fpccr & kLazyPending) == 0 ? cost::kFpFrame : 0);
  look_again();
}

// PopStack. A fault here leaves the stack as it was, and is taken in place of the return.
bool Core::pop_frame() {
  const uint32_t exc_return = state.exc_return;
  const bool thread = (exc_return & 8) != 0, psp = (exc_return & 4) != 0, fp = (exc_return & 0x10) == 0;
  const bool as_privileged = !thread || (state.control & 1) == 0;
  const uint32_t frame = psp ? state.other_sp : state.r[kSp];
  std::array<uint32_t, 25> words{};
  const bool reads_fp = fp && (state.scb.fpccr & kLazyPending) == 0;
  uint32_t failed = kStackOk;
  for (uint32_t i = 0; i < (reads_fp ? words.size() : 8); ++i) failed |= stack_access(frame + 4 * i, words[i], false, as_privileged);
  if (failed != kStackOk) {
    state.scb.cfsr |= (failed & kStackBus) != 0 ? 1u << 11 : 1u << 3;  // UNSTKERR, MUNSTKERR
    state.phase_exception = fault_taken((failed & kStackBus) != 0 ? kBusFault : kMemManage);
  } else if (thread != ((words[7] & 0x1FF) == 0) || (words[7] & 0x1FF) >= kExceptions) {
    state.scb.cfsr |= 1u << 18;  // INVPC: the frame is of the other mode, or of no exception
    state.phase_exception = fault_taken(kUsageFault);
    failed = kStackBus;
  }
  if (failed != kStackOk) {
    state.nvic.pending.set(state.phase_exception, true);
    if (!state.locked_up) tail_chain(exc_return);
    return false;
  }
  if (fp) state.scb.fpccr &= ~kLazyPending;
  if (reads_fp) {
    for (uint32_t i = 0; i < 16; ++i) state.s[i] = words[8 + i];
    state.fpscr = words[24];
  }
  const bool aligns = fp || (state.scb.ccr & 0x200) != 0;
  const uint32_t sp = (frame + (fp ? kFpFrameBytes : kFrameBytes)) | (aligns && (words[7] & 0x200) != 0 ? 4u : 0);
  if (psp) std::swap(state.r[kSp], state.other_sp);
  state.r[kSp] = sp;
  state.control = (state.control & 1) | (psp ? 2u : 0) | (fp ? 4u : 0);
  for (uint32_t i = 0; i < 4; ++i) state.r[i] = words[i];
  state.r[12] = words[4];
  state.r[kLr] = words[5];
  state.r[kPc] = words[6] & ~1u;
  set_xpsr(words[7]);
  return true;
}

void Core::end_return() {
  state.phase = Phase::running;
  if (!pop_frame()) return;
  look_again();
  if (state.ipsr != 0 || (state.scb.scr & 2) == 0) return;
  state.sleeping = true;  // SLEEPONEXIT
  state.sleeping_for_event = false;
}

// The first floating-point instruction of a handler saves the registers of what it interrupted (B1.5.7).
bool Core::save_lazy_fp(const Op& op) {
  const uint32_t failed = push_fp(state.scb.fpcar, (state.scb.fpccr & 2) == 0);
  if (failed == kStackOk) {
    state.scb.fpccr &= ~kLazyPending;
    state.cycle += cost::kFpFrame;
    return true;
  }
  const bool bus = (failed & kStackBus) != 0;
  state.scb.cfsr |= bus ? 1u << 13 : 1u << 5;  // LSPERR, MLSPERR
  state.scb.fpccr &= ~kLazyPending;
  take_synchronous(bus ? kBusFault : kMemManage, state.r[kPc] - op.bytes, (op.tag & kTagInIt) != 0 ? state.it_of_instruction : 0);
  return false;
}

}  // namespace rotorloop::mcu
