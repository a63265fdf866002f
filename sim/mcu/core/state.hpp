// All that a Cortex-M4 remembers, as plain data: a snapshot is a copy. Names and bit positions are those of the ARMv7-M Architecture
// Reference Manual (DDI 0403); registers are kept as the program reads them unless a comment says otherwise.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace rotorloop::mcu {

// Numbers of exceptions; interrupt line n of the chip is exception 16 + n.
enum Exception : uint32_t {
  kNoException = 0,
  kReset = 1,
  kNmi = 2,
  kHardFault = 3,
  kMemManage = 4,
  kBusFault = 5,
  kUsageFault = 6,
  kSvCall = 11,
  kDebugMonitor = 12,
  kPendSv = 14,
  kSysTick = 15,
  kFirstInterrupt = 16,
};
inline constexpr uint32_t kExceptions = 128;    // 112 interrupt lines; the STM32G431 has 102
inline constexpr uint8_t kPriorityMask = 0xF0;  // four bits of priority, as on all STM32 with this core

// A set of exceptions.
struct ExceptionSet {
  std::array<uint64_t, 2> words{};
  bool has(uint32_t n) const { return (words[n >> 6] >> (n & 63) & 1) != 0; }
  void set(uint32_t n, bool on) {
    const uint64_t bit = uint64_t{1} << (n & 63);
    words[n >> 6] = on ? words[n >> 6] | bit : words[n >> 6] & ~bit;
  }
  uint32_t interrupts(uint32_t word) const {  // 32 lines at a time, as NVIC registers have them
    const uint32_t first = kFirstInterrupt + 32 * word;
    const uint64_t low = words[first >> 6] >> (first & 63);
    const uint64_t high = (first & 63) != 0 && (first >> 6) + 1 < words.size() ? words[(first >> 6) + 1] << (64 - (first & 63)) : 0;
    return static_cast<uint32_t>(low | high);
  }
};

struct NvicState {
  ExceptionSet pending, active, enabled, line;  // line: the level at the input of each interrupt
  std::array<uint8_t, kExceptions> priority{};  // of exceptions 4 and up
};

struct SystemControlState {
  uint32_t vtor = 0, aircr_prigroup = 0, scr = 0;
  uint32_t ccr = 0x200;        // STKALIGN
  uint32_t shcsr_enables = 0;  // bits 16 to 18
  uint32_t cfsr = 0, hfsr = 0, mmfar = 0, bfar = 0;
  uint32_t cpacr = 0, actlr = 0, demcr = 0, dfsr = 0;
  uint32_t fpccr = 0xC0000000, fpcar = 0, fpdscr = 0;  // ASPEN and LSPEN
};

struct SysTickState {
  uint32_t ctrl = 0, load = 0;
  uint32_t held = 0;           // the value while it does not count
  uint64_t zero_at_cycle = 0;  // while it counts: when it reaches 0
};

struct DwtState {
  uint32_t ctrl = 0x40000000;  // four comparators, none of them modelled
  uint32_t held = 0;           // CYCCNT while it does not count
  uint64_t zero_at_cycle = 0;  // while it counts: when it was 0
};

struct MpuRegion {
  uint32_t rbar = 0, rasr = 0;
};
struct MpuState {
  uint32_t ctrl = 0, rnr = 0;
  std::array<MpuRegion, 8> regions{};
};

// Instruction and data cache of the flash interface, and its prefetch buffer. Words are addresses divided by 8, lines by 32.
template <std::size_t kLines>
struct FlashCache {
  std::array<uint32_t, kLines> line{};
  std::array<uint8_t, kLines> valid{};  // one bit for each word of the line
  uint32_t next = 0;                    // replaced in turn
};
struct FlashPortState {
  FlashCache<32> code;
  FlashCache<8> data;
  uint32_t current_word = ~0u, prefetched_word = ~0u;
  uint64_t prefetch_ready_cycle = 0;
};

// What the core is doing between two instructions.
enum class Phase : uint8_t { running, stacking, unstacking };

// How often an exception was taken and how long its handler ran, those that preempted it included. Cycles of handlers with zero wait
// states are cycles less waits. Figures for reports: the program sees none of them.
struct Served {
  uint64_t count = 0, cycles = 0, waits = 0, longest_cycles = 0, longest_waits = 0, begun_cycle = 0, begun_waits = 0;
};

struct CoreState {
  // R0 to R12, SP of the moment, LR, address of the next instruction; then a register that is written and never read, and one that is 0.
  std::array<uint32_t, 18> r{};
  uint32_t n = 0;         // bit 31 is the flag
  uint32_t z = 1;         // the flag is set when this is 0
  uint32_t c = 0, v = 0;  // 0 or 1
  uint32_t q = 0, ge = 0;
  uint32_t it = 0;                 // ITSTATE of the next instruction
  uint32_t it_of_instruction = 0;  // ITSTATE of the one that executes, valid inside of an IT block
  uint32_t thumb = 1;
  uint32_t ipsr = 0, primask = 0, faultmask = 0, basepri = 0, control = 0;
  uint32_t other_sp = 0;  // the stack pointer that is not in r[13]
  std::array<uint32_t, 32> s{};
  uint32_t fpscr = 0;

  uint64_t cycle = 0;         // since power-up; drives time
  uint64_t flash_waits = 0;   // cycles that the flash would have the core wait (flash_timing.hpp)
  uint64_t instructions = 0;  // executed, those whose condition failed too

  Phase phase = Phase::running;
  uint32_t phase_exception = 0, exc_return = 0;
  uint64_t phase_end_cycle = 0;
  bool sleeping = false, sleeping_for_event = false, event = false, exclusive = false;
  bool locked_up = false, reset_requested = false, at_breakpoint = false;

  NvicState nvic;
  SystemControlState scb;
  SysTickState systick;
  DwtState dwt;
  MpuState mpu;
  FlashPortState flash;

  std::array<Served, kExceptions> served{};
  std::array<uint32_t, 32> recent{};  // addresses of the last instructions, by the low bits of `instructions`
};
static_assert(std::is_trivially_copyable_v<CoreState>);

inline constexpr uint32_t kSp = 13, kLr = 14, kPc = 15, kNowhere = 16, kZero = 17;

}  // namespace rotorloop::mcu
