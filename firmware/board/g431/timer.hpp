// TIM1 as the modulator of three half bridges (RM0440, section 28), and TIM2 as the clock of microseconds (section 29).
// The high side of a phase is on around the trough of the counter and the low side around its crest: there the amplifiers are sampled
// and there the compares change, at the update event of every other crest. That it comes at a crest and not at a trough: the repetition
// counter is zero at the start, so the first crest is an event, and it is written right after the start, so that each further one comes
// four ends of a count later (section 28.3.3: written after the start, odd, the event is at the overflow).
#pragma once
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct TimerRegisters {
  Register cr1, cr2, smcr, dier, sr, egr, ccmr1, ccmr2, ccer, cnt, psc, arr, rcr, ccr[4], bdtr, ccr5, ccr6, ccmr3, dtr2, ecr, tisel, af1,
      af2;
};
static_assert(offsetof(TimerRegisters, ccmr1) == 0x18 && offsetof(TimerRegisters, arr) == 0x2C && offsetof(TimerRegisters, ccr) == 0x34 &&
              offsetof(TimerRegisters, bdtr) == 0x44 && offsetof(TimerRegisters, ccmr3) == 0x50 && offsetof(TimerRegisters, af2) == 0x64);
inline TimerRegisters& tim1() { return block<TimerRegisters, 0x40012C00>(); }
inline TimerRegisters& tim2() { return block<TimerRegisters, 0x40000000>(); }

namespace tim_bits {
inline constexpr std::uint32_t kOn = bit(0), kCentreAligned = field(1, 5), kPreloadTop = bit(7);   // CR1
inline constexpr std::uint32_t kTrgoUpdate = field(2, 4), kTrgo2Oc4 = field(7, 20);                // CR2
inline constexpr std::uint32_t kUpdate = bit(0), kBreakFlag = bit(7), kSystemBreakFlag = bit(13);  // EGR, SR
inline constexpr std::uint32_t kBreakInterrupt = bit(7);                                           // DIER
inline constexpr std::uint32_t kPwm1 = 6, kPwm2 = 7, kPreload = bit(3);                            // of a channel in CCMRx
inline constexpr std::uint32_t kOssi = bit(10), kOssr = bit(11), kBreakOn = bit(12), kBreakHigh = bit(13), kMainOutput = bit(15);  // BDTR
inline constexpr std::uint32_t kLock2 = field(2, 8);  // dead time, break, idle levels, polarities and OSSx fixed until the next reset
}  // namespace tim_bits

// DTG of the dead time at 170 MHz, rounded up; RM0440, TIM1_BDTR. Up to 127 ticks of 5.88 ns in single steps, then in steps of 2, 8, 16.
constexpr std::uint32_t dead_time_bits(std::uint32_t dead_time_ns) {
  const std::uint32_t ticks = (dead_time_ns * 170u + 999u) / 1000u;
  if (ticks <= 127u) return ticks;
  if (ticks <= 2u * 127u) return 0x80u | ((ticks + 1u) / 2u - 64u);
  if (ticks <= 8u * 63u) return 0xC0u | ((ticks + 7u) / 8u - 32u);
  return 0xE0u | ((ticks + 15u) / 16u - 32u);
}
// What these bits make, in ticks.
constexpr std::uint32_t dead_time_ticks(std::uint32_t bits) {
  if ((bits & 0x80u) == 0u) return bits;
  if ((bits & 0x40u) == 0u) return 2u * (64u + (bits & 0x3Fu));
  return (bits & 0x20u) == 0u ? 8u * (32u + (bits & 0x1Fu)) : 16u * (32u + (bits & 0x1Fu));
}

struct BridgeTiming {
  std::uint32_t top = 0;  // counts of half a PWM period
  std::uint32_t periods_per_sample = 2;
  std::uint32_t dead_time_ns = 0;
};

// Everything but the start: outputs off and at their idle level, low; break inputs armed. TRGO: each update event. TRGO2: each trough.
void prepare_bridge(const BridgeTiming& timing);
// With interrupts masked: the first crest, 10 us later, has to find what is written here.
void start_bridge_timer(const BridgeTiming& timing);

// All six low at once: hardware brings the outputs to their idle level.
[[gnu::always_inline]] inline void bridge_off() { tim1().bdtr.clear(tim_bits::kMainOutput); }
inline bool bridge_is_on() { return tim1().bdtr.has(tim_bits::kMainOutput); }

// The six enable bits of CCER and the modes of the channels that make these gates follow the compares. A low side alone follows OCxREF as
// it is (table 285: no complement where only CCxNE is set), so its channel then runs in the other PWM mode.
struct GateBits {
  std::uint32_t ccer, ccmr1, ccmr2;
};
constexpr GateBits gate_bits(std::uint8_t mask) {
  using namespace tim_bits;
  std::uint32_t ccer = 0, modes[3]{};
  for (std::size_t k = 0; k < 3; ++k) {
    const bool high = (mask & firmware::high_gate(k)) != 0, low = (mask & firmware::low_gate(k)) != 0;
    ccer |= ((high ? 1u : 0u) | (low ? 4u : 0u)) << (4u * k);
    modes[k] = kPreload | field(low && !high ? kPwm2 : kPwm1, 4);
  }
  return {ccer, modes[0] | modes[1] << 8u, modes[2] | (kPreload | field(kPwm1, 4)) << 8u};
}
inline constexpr GateBits kAllGateBits = gate_bits(firmware::kAllGates);

inline void write_gates(const GateBits& g) {
  TimerRegisters& t = tim1();
  if (t.ccmr1.read() != g.ccmr1 || t.ccmr2.read() != g.ccmr2 || t.ccer.read() != g.ccer) {
    t.bdtr.clear(tim_bits::kMainOutput);  // never a moment of mixed modes
    t.ccmr1.write(g.ccmr1);
    t.ccmr2.write(g.ccmr2);
    t.ccer.write(g.ccer);
  }
  t.bdtr.set(tim_bits::kMainOutput);
}

// 1 MHz, 32 bits.
void start_microseconds();

// 64 bits of it. The count of half turns is written by the main loop alone, at least once in each of 36 minutes; both contexts read.
class Microseconds {
 public:
  void keep() {
    const std::uint32_t now = tim2().cnt.read(), halves = halves_;
    if ((now >> 31u) != (halves & 1u)) halves_ = halves + 1;
  }
  std::uint64_t now() const {
    const std::uint32_t halves = halves_, now = tim2().cnt.read();
    const std::uint32_t passed = halves + ((now >> 31u) != (halves & 1u) ? 1u : 0u);
    return static_cast<std::uint64_t>(passed >> 1u) << 32u | now;
  }

 private:
  volatile std::uint32_t halves_ = 0;
};

}  // namespace rotorloop::g431
