// The System Control Space: NVIC and System Control Block (B3.2, B3.4). Registers of 32 bits; priorities and CFSR in bytes and halfwords
// too.
#include <bit>

#include "sim/mcu/core/core.hpp"

namespace rotorloop::mcu {
namespace {

constexpr uint32_t kScs = 0xE000E000;
constexpr uint32_t kInterruptWords = (kExceptions - kFirstInterrupt) / 32 + 1;

void set_interrupts(ExceptionSet& set, uint32_t word, uint32_t bits, bool on) {
  for (; bits != 0; bits &= bits - 1) {
    const uint32_t n = kFirstInterrupt + 32 * word + static_cast<uint32_t>(std::countr_zero(bits));
    if (n < kExceptions) set.set(n, on);
  }
}

// Exceptions 4 to 15 in SHPR1 to 3, interrupts in IPR.
bool is_priority(uint32_t offset, uint32_t& first) {
  if (offset >= 0xD18 && offset < 0xD24) {
    first = 4 + (offset - 0xD18);
    return true;
  }
  first = kFirstInterrupt + (offset - 0x400);
  return offset >= 0x400 && offset < 0x400 + 4 * 32 && first + 3 < kExceptions;
}

}  // namespace

bool Core::is_system_register(uint32_t address) const { return address >> 12 == 0xE000E || address >> 12 == 0xE0001; }

bool Core::read_nvic(uint32_t offset, uint32_t& value) const {
  const uint32_t word = (offset & 0x7F) / 4;
  uint32_t first = 0;
  if (is_priority(offset, first)) {
    value = 0;
    for (uint32_t i = 0; i < 4; ++i) value |= static_cast<uint32_t>(state.nvic.priority[first + i]) << (8 * i);
    return true;
  }
  if (offset < 0x100 || offset >= 0x380 || word >= kInterruptWords) return false;
  switch (offset & ~0x7Fu) {
    case 0x100:
    case 0x180:
      value = state.nvic.enabled.interrupts(word);
      return true;
    case 0x200:
    case 0x280:
      value = state.nvic.pending.interrupts(word);
      return true;
    case 0x300:
      value = state.nvic.active.interrupts(word);
      return true;
    default:
      return false;
  }
}

bool Core::write_nvic(uint32_t offset, uint32_t value) {
  const uint32_t word = (offset & 0x7F) / 4;
  uint32_t first = 0;
  look_again();
  if (is_priority(offset, first)) {
    for (uint32_t i = 0; i < 4; ++i) state.nvic.priority[first + i] = static_cast<uint8_t>(value >> (8 * i)) & kPriorityMask;
    return true;
  }
  if (offset < 0x100 || offset >= 0x380 || word >= kInterruptWords) return false;
  switch (offset & ~0x7Fu) {
    case 0x100:
      set_interrupts(state.nvic.enabled, word, value, true);
      return true;
    case 0x180:
      set_interrupts(state.nvic.enabled, word, value, false);
      return true;
    case 0x200:
      set_interrupts(state.nvic.pending, word, value, true);
      return true;
    case 0x280:
      set_interrupts(state.nvic.pending, word, value & ~state.nvic.line.interrupts(word), false);
      return true;
    default:
      return (offset & ~0x7Fu) == 0x300;
  }
}

namespace {

uint32_t handler_control(const CoreState& s) {
  static constexpr struct {
    uint8_t exception, active_bit, pending_bit;
  } kBits[7] = {{kMemManage, 0, 13},    {kBusFault, 1, 14}, {kUsageFault, 3, 12}, {kSvCall, 7, 15},
                {kDebugMonitor, 8, 31}, {kPendSv, 10, 31},  {kSysTick, 11, 31}};
  uint32_t value = s.scb.shcsr_enables;
  for (const auto& b : kBits) {
    if (s.nvic.active.has(b.exception)) value |= 1u << b.active_bit;
    if (b.pending_bit != 31 && s.nvic.pending.has(b.exception)) value |= 1u << b.pending_bit;
  }
  return value;
}

void set_handler_control(CoreState& s, uint32_t value) {
  s.scb.shcsr_enables = value & 0x70000;
  s.nvic.active.set(kMemManage, (value & 1) != 0);
  s.nvic.active.set(kBusFault, (value & 2) != 0);
  s.nvic.active.set(kUsageFault, (value & 8) != 0);
  s.nvic.active.set(kSvCall, (value & 1u << 7) != 0);
  s.nvic.active.set(kPendSv, (value & 1u << 10) != 0);
  s.nvic.active.set(kSysTick, (value & 1u << 11) != 0);
  s.nvic.pending.set(kUsageFault, (value & 1u << 12) != 0);
  s.nvic.pending.set(kMemManage, (value & 1u << 13) != 0);
  s.nvic.pending.set(kBusFault, (value & 1u << 14) != 0);
  s.nvic.pending.set(kSvCall, (value & 1u << 15) != 0);
}

uint32_t interrupt_control(const CoreState& s, uint32_t best) {
  uint32_t value = s.ipsr | best << 12;
  const int active = std::popcount(s.nvic.active.words[0]) + std::popcount(s.nvic.active.words[1]);
  bool interrupt = false;
  for (uint32_t word = 0; word < kInterruptWords; ++word) interrupt = interrupt || s.nvic.pending.interrupts(word) != 0;
  if (active <= 1) value |= 1u << 11;  // RETTOBASE
  if (interrupt) value |= 1u << 22;
  if (s.nvic.pending.has(kSysTick)) value |= 1u << 26;
  if (s.nvic.pending.has(kPendSv)) value |= 1u << 28;
  if (s.nvic.pending.has(kNmi)) value |= 1u << 31;
  return value;
}

}  // namespace

void Core::write_icsr(uint32_t value) {
  if ((value & 1u << 25) != 0) state.nvic.pending.set(kSysTick, false);
  if ((value & 1u << 27) != 0) state.nvic.pending.set(kPendSv, false);
  if ((value & 1u << 26) != 0) set_pending(kSysTick);
  if ((value & 1u << 28) != 0) set_pending(kPendSv);
  if ((value & 1u << 31) != 0) set_pending(kNmi);
}

namespace {

// Registers that read as they were written.
struct PlainRegister {
  uint32_t offset;
  uint32_t SystemControlState::*value;
  uint32_t writable;
};
constexpr PlainRegister kPlain[] = {
    {0x008, &SystemControlState::actlr, 0x307},       {0xD08, &SystemControlState::vtor, 0xFFFFFF80},
    {0xD10, &SystemControlState::scr, 0x16},          {0xD14, &SystemControlState::ccr, 0x31B},
    {0xD34, &SystemControlState::mmfar, 0xFFFFFFFF},  {0xD38, &SystemControlState::bfar, 0xFFFFFFFF},
    {0xD88, &SystemControlState::cpacr, 0xF00000},    {0xDFC, &SystemControlState::demcr, 0x010F07F1},
    {0xF34, &SystemControlState::fpccr, 0xC000017B},  {0xF38, &SystemControlState::fpcar, 0xFFFFFFF8},
    {0xF3C, &SystemControlState::fpdscr, 0x07C00000},
};
// Status: a bit is cleared by writing 1.
constexpr PlainRegister kStatus[] = {
    {0xD28, &SystemControlState::cfsr, 0}, {0xD2C, &SystemControlState::hfsr, 0}, {0xD30, &SystemControlState::dfsr, 0}};
// Read only: ICTR; CPUID: Cortex-M4 r0p1; AFSR; DHCSR: no debugger; MVFR0 and MVFR1 of the FPv4-SP.
constexpr struct {
  uint32_t offset, value;
} kConstant[] = {{0x004, kInterruptWords - 1}, {0xD00, 0x410FC241}, {0xD3C, 0}, {0xDF0, 0}, {0xF40, 0x10110021}, {0xF44, 0x11000011}};

}  // namespace

bool Core::read_scb(uint32_t offset, uint32_t& value) const {
  for (const auto& r : kPlain)
    if (r.offset == offset) {
      value = state.scb.*r.value;
      return true;
    }
  for (const auto& r : kStatus)
    if (r.offset == offset) {
      value = state.scb.*r.value;
      return true;
    }
  for (const auto& r : kConstant)
    if (r.offset == offset) {
      value = r.value;
      return true;
    }
  switch (offset) {
    case 0xD04:
      value = interrupt_control(state, best_pending());
      return true;
    case 0xD0C:
      value = 0xFA050000 | state.scb.aircr_prigroup << 8;
      return true;
    case 0xD24:
      value = handler_control(state);
      return true;
    default:
      return offset >= 0xD90 && offset <= 0xDB8 && read_mpu(offset - 0xD00, value);
  }
}

bool Core::write_scb(uint32_t offset, uint32_t value) {
  for (const auto& r : kPlain)
    if (r.offset == offset) {
      state.scb.*r.value = value & r.writable;
      return true;
    }
  for (const auto& r : kStatus)
    if (r.offset == offset) {
      state.scb.*r.value &= ~value;
      return true;
    }
  for (const auto& r : kConstant)
    if (r.offset == offset) return true;
  switch (offset) {
    case 0xD04:
      write_icsr(value);
      return true;
    case 0xD0C:
      if (value >> 16 != 0x05FA) return true;  // the key
      state.scb.aircr_prigroup = value >> 8 & 7;
      if ((value & 4) != 0) state.reset_requested = true;
      return true;
    case 0xD24:
      set_handler_control(state, value);
      return true;
    case 0xF00:
      if ((value & 0x1FF) + kFirstInterrupt < kExceptions) set_pending(kFirstInterrupt + (value & 0x1FF));  // STIR
      return true;
    default:
      return offset >= 0xD90 && offset <= 0xDB8 && write_mpu(offset - 0xD00, value);
  }
}

// What follows from control registers, brought up to date after any of them changed.
void Core::system_register_changed() {
  choose_checked();
  state.nvic.enabled.set(kMemManage, (state.scb.shcsr_enables & 1u << 16) != 0);
  state.nvic.enabled.set(kBusFault, (state.scb.shcsr_enables & 1u << 17) != 0);
  state.nvic.enabled.set(kUsageFault, (state.scb.shcsr_enables & 1u << 18) != 0);
  update_fp_ready();
  look_again();
}

bool Core::read_system(uint32_t address, uint32_t bytes, uint32_t& value) {
  const uint32_t word = address & ~3u, offset = word - kScs;
  uint32_t whole = 0;
  const bool known =
      address < kScs ? read_timers(word, whole) : read_timers(word, whole) || read_nvic(offset, whole) || read_scb(offset, whole);
  if (!known || (address & 3) + bytes > 4) return false;
  whole >>= 8 * (address & 3);
  value = bytes == 4 ? whole : whole & ((1u << (8 * bytes)) - 1);
  return true;
}

bool Core::write_system(uint32_t address, uint32_t bytes, uint32_t value) {
  const uint32_t word = address & ~3u, offset = word - kScs, shift = 8 * (address & 3);
  if ((address & 3) + bytes > 4) return false;
  if (bytes != 4) {
    uint32_t first = 0, whole = 0;
    const uint32_t mask = ((1u << (8 * bytes)) - 1) << shift;
    value <<= shift;
    if (address >= kScs && is_priority(offset, first)) {
      read_nvic(offset, whole);
      value |= whole & ~mask;
    } else if (offset != 0xD28) {
      return false;
    }
  }
  const bool known = write_timers(word, value) || (address >= kScs && (write_nvic(offset, value) || write_scb(offset, value)));
  if (known) system_register_changed();
  return known;
}

}  // namespace rotorloop::mcu
