// The loop over instructions, and what is between two of them.
#include "sim/mcu/core/core.hpp"

#include <algorithm>

#include "sim/mcu/core/decode.hpp"

namespace rotorloop::mcu {

Core::Core(MemoryMap& memories, Bus& bus, uint32_t decoded_instructions)
    : memories_(&memories), bus_(&bus), decoded_(decoded_instructions + 2), slot_mask_(decoded_instructions - 1) {}

void Core::reset(uint32_t vector_table) {
  const uint64_t now = state.cycle, waits = state.flash_waits, executed = state.instructions;
  const ExceptionSet lines = state.nvic.line;
  const auto served = state.served;
  const auto recent = state.recent;
  state = CoreState{};
  state.served = served;
  state.recent = recent;
  state.cycle = now;
  state.flash_waits = waits;
  state.instructions = executed;
  state.nvic.line = state.nvic.pending = lines;
  for (const uint32_t n : {kNmi, kHardFault, kSvCall, kDebugMonitor, kPendSv, kSysTick}) state.nvic.enabled.set(n, true);
  state.scb.vtor = vector_table;
  state.r[kLr] = 0xFFFFFFFF;
  uint32_t sp = 0, entry = 0;
  const bool read = read_vector(vector_table, sp) && read_vector(vector_table + 4, entry);
  state.r[kSp] = sp & ~3u;
  state.r[kPc] = entry & ~1u;
  state.thumb = entry & 1;
  restored();
  if (!read) lock_up();
}

void Core::restored() {
  context_ += kTagGeneration;
  ready_words_.fill(~0u);
  update_context();
  system_register_changed();
}

void Core::code_changed(uint32_t address, uint32_t bytes) {
  if (bytes >= 4096) {
    context_ += kTagGeneration;
  } else {
    for (uint32_t at = 0; at < bytes + 4; at += 4) forget_decoded(address + at);
  }
  state.flash = FlashPortState{};
  ready_words_.fill(~0u);
}

void Core::set_clocking(Clocking clocking, uint32_t wait_states) {
  clocking_ = clocking;
  wait_states_ = wait_states;
  look_again();
}

// The context of decoded instructions: privilege matters to the MPU, and IT blocks to the flags.
void Core::update_context() {
  context_ &= ~(kTagGeneration - 1);
  if (privileged()) context_ |= kTagPrivileged;
  if (state.it != 0) context_ |= kTagInIt;
  update_fp_ready();
}

void Core::update_fp_ready() {
  const uint32_t access = state.scb.cpacr >> 20;
  const bool allowed = privileged() ? (access & 1) != 0 : (access & 3) == 3;
  fp_ready = allowed && (state.scb.fpccr & 1) == 0 && ((state.control & 4) != 0 || (state.scb.fpccr >> 31) == 0);
}

void Core::set_it(uint32_t it) {
  state.it = it;
  context_ = (context_ & ~kTagInIt) | (it != 0 ? kTagInIt : 0);
}

// The word is in the instruction cache, and nothing else of the instruction has to be looked for.
inline bool Core::code_is_ready(uint32_t pc, uint32_t last_word) const {
  const uint32_t first_word = pc >> 3;
  return ready_words_[last_word % ready_words_.size()] == last_word && last_word != state.flash.prefetched_word &&
         (first_word == last_word || first_word == state.flash.current_word);
}

// Moves on in the IT block; false: the condition of the instruction does not hold.
bool Core::begin_in_it(const Op& op) {
  const uint32_t it = state.it;
  state.it_of_instruction = it;
  set_it((it & 7) == 0 ? 0 : (it & 0xE0) | ((it << 1) & 0x1F));
  if (condition(it >> 4) || op.execute == exec_always()) return true;
  state.cycle -= op.cycles - 1u;
  return false;
}

template <bool kFlash>
void Core::execute() {
  Op* next = &slot(state.r[kPc]);
  while (state.cycle < deadline_) {
    const uint32_t pc = state.r[kPc];
    Op* op = next;
    if (op->tag != (context_ | pc)) [[unlikely]] {
      op = &slot(pc);
      if (op->tag != (context_ | pc)) {
        decode_at(pc);
        next = &slot(state.r[kPc]);
        continue;
      }
    }
    const uint32_t bytes = op->bytes;
    next = op + bytes / 2;  // the one that follows, unless this one branches
    if constexpr (kFlash) {
      if (op->last_word != state.flash.current_word) {
        if (code_is_ready(pc, op->last_word))
          state.flash.current_word = op->last_word;
        else
          wait_for_flash_code(pc, op->last_word);
      }
    }
    state.r[kPc] = pc + bytes;
    state.recent[state.instructions & 31] = pc;
    state.cycle += op->cycles;
    ++state.instructions;
    if ((context_ & kTagInIt) != 0 && !begin_in_it(*op)) [[unlikely]]
      continue;
    op->execute(*this, *op);
  }
}

void Core::run_between() {
  service_systick();
  if (state.phase != Phase::running) {
    if (state.phase == Phase::unstacking && can_preempt(best_pending())) tail_chain(state.exc_return);
    state.cycle = std::max(state.cycle, std::min(state.phase_end_cycle, limit_));
    if (state.cycle < state.phase_end_cycle) return;
    state.phase == Phase::stacking ? end_entry() : end_return();
    return;
  }
  if (take_pending()) return;
  const uint64_t event = systick_event();
  if (state.sleeping) {
    state.sleeping = !wakes();
    if (state.sleeping) state.cycle = std::max(state.cycle, std::min(limit_, event));
    return;
  }
  if (state.thumb == 0) {
    Op here;
    here.bytes = 0;
    here.tag = 0;
    usage_fault(here, 1u << 17);  // INVSTATE
    return;
  }
  deadline_ = std::min(limit_, event);
  // Waits are counted in either case: which figure is time is decided where they are added.
  if (wait_states_ != 0)
    execute<true>();
  else
    execute<false>();
}

Stopped Core::run_until(uint64_t cycle) {
  limit_ = cycle;
  while (state.cycle < limit_) {
    if (state.locked_up) {
      state.cycle = limit_;  // time goes on: a watchdog may end it
      return Stopped::locked_up;
    }
    if (state.reset_requested) return Stopped::reset_request;
    if (state.at_breakpoint) return Stopped::breakpoint;
    run_between();
  }
  if (state.locked_up) return Stopped::locked_up;
  if (state.reset_requested) return Stopped::reset_request;
  return state.at_breakpoint ? Stopped::breakpoint : Stopped::at_cycle;
}

Stopped Core::step() {
  const uint64_t executed = state.instructions;
  const Phase phase = state.phase;
  Stopped stopped = run_until(state.cycle + 1);
  while (stopped == Stopped::at_cycle && state.instructions == executed && state.phase == phase && !state.sleeping &&
         phase != Phase::running)
    stopped = run_until(state.cycle + 1);
  return stopped;
}

uint32_t Core::apsr() const {
  return (state.n & 0x80000000u) | (state.z == 0 ? 1u << 30 : 0) | state.c << 29 | state.v << 28 | state.q << 27 | state.ge << 16;
}

void Core::set_apsr(uint32_t value, bool nzcvq, bool ge) {
  if (nzcvq) {
    state.n = value;
    state.z = ~value & (1u << 30);
    state.c = value >> 29 & 1;
    state.v = value >> 28 & 1;
    state.q = value >> 27 & 1;
  }
  if (ge) state.ge = value >> 16 & 15;
}

uint32_t Core::xpsr() const { return apsr() | (state.it & 3) << 25 | (state.it >> 2) << 10 | state.thumb << 24 | state.ipsr; }

void Core::set_xpsr(uint32_t value) {
  set_apsr(value, true, true);
  state.thumb = value >> 24 & 1;
  state.ipsr = value & 0x1FF;
  state.it = (value >> 25 & 3) | (value >> 10 & 0x3F) << 2;
  update_context();
}

}  // namespace rotorloop::mcu
