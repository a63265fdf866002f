// A Cortex-M4 with single-precision FPU (ARMv7E-M, FPv4-SP) that executes a program instruction by instruction. The caller owns time: it
// says until which cycle to run, and moves its peripherals in between.
#pragma once
#include <cstring>
#include <vector>

#include "sim/mcu/core/bus.hpp"
#include "sim/mcu/core/op.hpp"
#include "sim/mcu/core/state.hpp"

namespace rotorloop::mcu {

// Which of the two cycle figures drives time. Both are counted in any case: zero wait states are cycle() - waits added.
enum class Clocking : uint8_t { zero_wait, flash };

enum class Stopped : uint8_t {
  at_cycle,       // the cycle asked for is reached, or passed by the rest of one instruction
  locked_up,      // a fault in HardFault or NMI: only a reset or a debugger goes on
  reset_request,  // AIRCR.SYSRESETREQ
  breakpoint,     // BKPT, when stop_at_breakpoints(true); who goes on clears state.at_breakpoint
};

// Kinds of access, for the MPU and for alignment.
enum class Access : uint8_t { fetch, read, write };

// Hears every load and store before it is done, and every fetch when its instruction is decoded. Not: stacking, vectors.
class AccessWatch {
 public:
  virtual ~AccessWatch() = default;
  virtual void on_access(uint32_t address, uint32_t bytes, Access kind) = 0;
};
enum class Watcher : uint8_t { chip, debugger };

class Core {
 public:
  // decoded_instructions: size of the cache of decoded instructions, a power of two; 32 768 cover 64 KB of code, and 131 072 also 128 KB of
  // flash with code in CCM beside it. No heap after this.
  Core(MemoryMap& memories, Bus& bus, uint32_t decoded_instructions = 32768);

  // --- for who runs it ------------------------------------------------------------------------------------------------
  // Power-up or reset: all state but the time as after reset; stack pointer and entry from the vectors at vector_table.
  void reset(uint32_t vector_table);
  // Executes until cycle() >= cycle. Interrupts are taken between any two instructions; peripherals see times inside through cycle().
  Stopped run_until(uint64_t cycle);
  // One instruction, or the entry of one exception, or the end of one; time passes without an instruction while it sleeps.
  Stopped step();
  uint64_t cycle() const { return state.cycle; }
  // From a peripheral: return from run_until at this cycle at the latest, for it has an event then.
  void stop_at(uint64_t cycle) {
    if (cycle < limit_) limit_ = cycle;
    if (cycle < deadline_) deadline_ = cycle;
  }
  // The level at an interrupt input. A rising edge makes it pending; a level still high at the end of the handler does so again.
  void set_interrupt_line(uint32_t interrupt, bool high);
  void pulse_interrupt(uint32_t interrupt) { set_pending(kFirstInterrupt + interrupt); }
  void raise_nmi() { set_pending(kNmi); }
  // The caller changed bytes of a memory that may hold code (flash programmed or erased, a file loaded).
  void code_changed(uint32_t address, uint32_t bytes);
  // All decoded instructions and the caches of the flash become void: after a snapshot was copied back.
  void restored();
  void set_clocking(Clocking clocking, uint32_t wait_states = 4);
  // Null: hears nothing more, and accesses are fast again.
  void watch(Watcher who, AccessWatch* watch) {
    watches_[static_cast<size_t>(who)] = watch;
    system_register_changed();
  }
  void stop_at_breakpoints(bool on) { stop_at_breakpoints_ = on; }

  // Registers as a debugger shows them.
  uint32_t xpsr() const;
  void set_xpsr(uint32_t value);
  void set_pc(uint32_t address) { state.r[kPc] = address & ~1u; }
  uint32_t main_sp() const { return uses_psp() ? state.other_sp : state.r[kSp]; }
  uint32_t process_sp() const { return uses_psp() ? state.r[kSp] : state.other_sp; }

  // Plain data; who changes it from outside calls restored().
  CoreState state;

  // --- for the instructions (exec_*.cpp) ------------------------------------------------------------------------------
  bool privileged() const { return state.ipsr != 0 || (state.control & 1) == 0; }
  bool uses_psp() const { return (state.control & 2) != 0 && state.ipsr == 0; }
  bool condition(uint32_t cond) const;
  void set_nz(uint32_t result) { state.n = state.z = result; }
  uint32_t apsr() const;
  void set_apsr(uint32_t value, bool nzcvq, bool ge);

  // Data accesses with all checks; false: a fault was taken, and the instruction has to return without any effect.
  bool load32(const Op& op, uint32_t address, uint32_t& value);
  bool load16(const Op& op, uint32_t address, uint32_t& value);
  bool load8(const Op& op, uint32_t address, uint32_t& value);
  bool store32(const Op& op, uint32_t address, uint32_t value);
  bool store16(const Op& op, uint32_t address, uint32_t value);
  bool store8(const Op& op, uint32_t address, uint32_t value);
  // As load and store of an unprivileged program (LDRT and its like).
  bool access_unprivileged(const Op& op, uint32_t address, uint32_t bytes, uint32_t& value, bool write);

  void branch(uint32_t address) { state.r[kPc] = address & ~1u; }
  void branch_interworking(const Op& op, uint32_t address);  // BX and loads of PC: also the return from an exception

  // Faults. Each takes the exception of the instruction `op`, which is then not executed.
  void usage_fault(const Op& op, uint32_t cfsr_bit);
  void memory_fault(const Op& op, uint32_t address, Access kind);
  void bus_fault(const Op& op, uint32_t address, Access kind);
  void take_synchronous(uint32_t exception, uint32_t return_address, uint32_t it);
  void breakpoint(const Op& op);

  bool prepare_fp(const Op& op);  // access check, lazy stacking, context; false: a fault was taken
  bool fp_ready = false;          // nothing of that is needed
  void update_fp_ready();

  void set_pending(uint32_t exception);
  void privilege_changed();
  void look_again() { deadline_ = 0; }  // something outside of straight execution is due
  void set_it(uint32_t it);
  int execution_priority() const;
  void system_register_changed();
  void mpu_changed();

  // Registers in the private peripheral bus that the core has itself (system_registers.cpp).
  bool is_system_register(uint32_t address) const;
  bool read_system(uint32_t address, uint32_t bytes, uint32_t& value);
  bool write_system(uint32_t address, uint32_t bytes, uint32_t value);

 private:
  template <bool kFlash>
  void execute();
  void decode_at(uint32_t pc);
  // In the order of addresses, so that the next instruction is found without a search; code in CCM does not share slots with flash.
  Op& slot(uint32_t pc) { return decoded_[((pc >> 1) ^ (pc >> 28) * 0x14000u) & slot_mask_]; }
  bool begin_in_it(const Op& op);
  void tell_watches(uint32_t address, uint32_t bytes, Access kind) {
    for (AccessWatch* w : watches_)
      if (w != nullptr) w->on_access(address, bytes, kind);
  }
  bool fetch16(const Op& op, uint32_t address, uint32_t& value);
  void update_context();
  void choose_checked();
  void forget_decoded(uint32_t address);
  void run_between();  // what is due between two instructions

  bool slow_access(const Op& op, uint32_t address, uint32_t bytes, uint32_t& value, bool write, bool as_privileged);
  bool read_vector(uint32_t address, uint32_t& value);
  bool raw_access(uint32_t address, uint32_t bytes, uint32_t& value, bool write);
  bool mpu_allows(uint32_t address, Access kind, bool as_privileged) const;
  bool mpu_rule(uint32_t address, Access kind, bool as_privileged) const;

  uint32_t best_pending() const;
  int priority_of(uint32_t exception) const;
  int group_priority(int priority) const;
  bool take_pending();
  bool valid_return(uint32_t exc_return) const;
  uint32_t fault_taken(uint32_t exception);
  void begin_entry();
  void end_entry();
  void enter_vector(uint32_t exception, uint32_t exc_return);
  void begin_return(const Op& op, uint32_t exc_return);
  void end_return();
  void push_frame();
  bool pop_frame();
  void deactivate(uint32_t exception);
  void lock_up();
  uint32_t stack_access(uint32_t address, uint32_t& value, bool write, bool as_privileged);
  uint32_t push_fp(uint32_t frame, bool as_privileged);
  bool save_lazy_fp(const Op& op);
  bool can_preempt(uint32_t exception) const;
  void pend_imprecise_bus_fault();
  void tail_chain(uint32_t exc_return);
  bool wakes() const;
  uint64_t systick_event() const;
  void service_systick();
  uint32_t systick_value() const;
  void set_systick(uint32_t ctrl);
  bool read_nvic(uint32_t offset, uint32_t& value) const;
  bool write_nvic(uint32_t offset, uint32_t value);
  bool read_scb(uint32_t offset, uint32_t& value) const;
  bool write_scb(uint32_t offset, uint32_t value);
  bool read_timers(uint32_t address, uint32_t& value);
  bool write_timers(uint32_t address, uint32_t value);
  bool read_mpu(uint32_t offset, uint32_t& value) const;
  bool write_mpu(uint32_t offset, uint32_t value);
  void write_icsr(uint32_t value);
  void wait_for_flash_code(uint32_t pc, uint32_t last_word);
  bool code_is_ready(uint32_t pc, uint32_t last_word) const;
  void wait_for_flash_data(uint32_t address);
  void add_waits(uint32_t cycles);

  MemoryMap* memories_;
  Bus* bus_;
  std::vector<Op> decoded_;  // and two behind the last slot that never match
  uint32_t slot_mask_;
  uint64_t context_ = 0;
  uint64_t deadline_ = 0, limit_ = 0;
  std::array<AccessWatch*, 2> watches_{};
  // What decides which loads and stores take the long way.
  struct Checks {
    MpuState mpu;
    bool all = false;           // unaligned accesses are trapped, somebody watches, or a thread without privileges has no default map
    uint64_t from = 0, to = 0;  // every region of the MPU lies in here
  };
  Checks checks_;
  // Words of flash known to be in the instruction cache, by their lowest bits: what `state.flash` has, found without a search.
  std::array<uint32_t, 512> ready_words_;
  bool stop_at_breakpoints_ = false;
  Clocking clocking_ = Clocking::zero_wait;
  uint32_t wait_states_ = 4;
};

// --- the short ways, which nearly every instruction takes --------------------------------------------------------------------
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "memories are read as the core stores them");

inline bool Core::condition(uint32_t cond) const {
  bool holds = true;
  const bool n = (state.n >> 31) != 0, z = state.z == 0, c = state.c != 0, v = state.v != 0;
  switch (cond >> 1) {
    case 0:
      holds = z;
      break;
    case 1:
      holds = c;
      break;
    case 2:
      holds = n;
      break;
    case 3:
      holds = v;
      break;
    case 4:
      holds = c && !z;
      break;
    case 5:
      holds = n == v;
      break;
    case 6:
      holds = !z && n == v;
      break;
    default:
      return true;
  }
  return holds != ((cond & 1) != 0);
}

namespace detail {
// Bytes of a plain memory at an address, or null where it has not all of them.
inline uint8_t* inside(const MemoryRegion& region, uint32_t address, uint32_t bytes) {
  const uint32_t offset = address - region.base;
  return uint64_t{offset} + bytes <= region.size_bytes ? region.bytes + offset : nullptr;
}
}  // namespace detail

#define RL_MCU_LOAD(NAME, TYPE)                                                                \
  inline bool Core::NAME(const Op& op, uint32_t address, uint32_t& value) {                    \
    const MemoryRegion& region = memories_->at(address);                                       \
    const uint8_t* bytes = detail::inside(region, address, sizeof(TYPE));                      \
    if (bytes == nullptr || address - region.checked_from < region.checked_bytes) [[unlikely]] \
      return slow_access(op, address, sizeof(TYPE), value, false, privileged());               \
    TYPE loaded;                                                                               \
    std::memcpy(&loaded, bytes, sizeof loaded);                                                \
    value = loaded;                                                                            \
    if (region.behind_flash_port) wait_for_flash_data(address);                                \
    return true;                                                                               \
  }
#define RL_MCU_STORE(NAME, TYPE)                                                                                   \
  inline bool Core::NAME(const Op& op, uint32_t address, uint32_t value) {                                         \
    const MemoryRegion& region = memories_->at(address);                                                           \
    uint8_t* bytes = detail::inside(region, address, sizeof(TYPE));                                                \
    if (bytes == nullptr || !region.writable || address - region.checked_from < region.checked_bytes) [[unlikely]] \
      return slow_access(op, address, sizeof(TYPE), value, true, privileged());                                    \
    const TYPE stored = static_cast<TYPE>(value);                                                                  \
    std::memcpy(bytes, &stored, sizeof stored);                                                                    \
    if (region.holds_code(address)) [[unlikely]]                                                                   \
      forget_decoded(address);                                                                                     \
    return true;                                                                                                   \
  }
RL_MCU_LOAD(load32, uint32_t)
RL_MCU_LOAD(load16, uint16_t)
RL_MCU_LOAD(load8, uint8_t)
RL_MCU_STORE(store32, uint32_t)
RL_MCU_STORE(store16, uint16_t)
RL_MCU_STORE(store8, uint8_t)
#undef RL_MCU_LOAD
#undef RL_MCU_STORE

// A word at an address can hold the start of an instruction one halfword before it.
inline void Core::forget_decoded(uint32_t address) {
  const uint32_t first = (address & ~1u) - 2;
  for (uint32_t at = first; at != first + 8; at += 2)
    if (Op& op = slot(at); (static_cast<uint32_t>(op.tag) & ~1u) == at) op.tag = ~uint64_t{0};
}

inline bool Core::prepare_fp(const Op& op) {
  if (fp_ready) [[likely]]
    return true;
  if (privileged() ? ((state.scb.cpacr >> 20) & 1) == 0 : ((state.scb.cpacr >> 20) & 3) != 3) {
    usage_fault(op, 1u << 19);  // NOCP
    return false;
  }
  if ((state.scb.fpccr & 1) != 0 && !save_lazy_fp(op)) return false;
  if ((state.control & 4) == 0 && (state.scb.fpccr >> 31) != 0) {
    state.control |= 4;
    state.fpscr = (state.fpscr & ~0x07C00000u) | (state.scb.fpdscr & 0x07C00000u);
  }
  update_fp_ready();
  return true;
}

}  // namespace rotorloop::mcu
