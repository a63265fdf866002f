// Cycles of instructions with zero wait states: Cortex-M4 Technical Reference Manual r0p1 (ARM DDI 0439), tables 3-1 and 7-1. Where the
// manual gives a range, the value taken and why stand here. Not checked on silicon.
#pragma once
#include <bit>
#include <cstdint>

namespace rotorloop::mcu::cost {

inline constexpr uint8_t kOne = 1;
// P, the refill of the pipeline after a taken branch: "1 to 3 depending on alignment and width of the target". Taken as 2.
inline constexpr uint8_t kRefill = 2;
inline constexpr uint8_t kBranch = 1 + kRefill;
inline constexpr uint8_t kLoad = 2;   // one less when it follows another load or store (Core::load chain): not modelled
inline constexpr uint8_t kStore = 1;  // the write buffer takes it: "STR is always one cycle"
inline constexpr uint8_t kLoadPc = kLoad + kRefill;
inline constexpr uint8_t kTableBranch = 2 + kRefill;
inline constexpr uint8_t kMultiplyAccumulate = 2;  // MLA, MLS; all other multiplications are 1
inline constexpr uint8_t kSpecial = 2;             // MRS, MSR: 1 or 2
inline constexpr uint8_t kDual = 3;                // LDRD, STRD: 1 + N
inline constexpr uint8_t kExclusive = 2;
inline constexpr uint8_t kVfpMultiplyAccumulate = 3;
inline constexpr uint8_t kVdiv = 14, kVsqrt = 14;
inline constexpr uint8_t kVfpLoad = 2, kVfpTwo = 2;
// Exceptions: 12 to the first instruction of the handler, 6 from one handler to the next, 10 back ("12 cycles" with the pipeline's refill
// counted with the instruction that returns). Floating-point state is 17 words: at entry, or at the first FP instruction when lazy.
inline constexpr uint32_t kEntry = 12, kTailChain = 6, kReturn = 10, kFpFrame = 17;

// 1 + N words.
inline constexpr uint8_t multiple(uint32_t words) { return static_cast<uint8_t>(1 + words); }

// SDIV, UDIV: "2 to 12, terminates early by the number of leading ones and zeros". Taken as 2 and one for three bits of the quotient.
inline constexpr uint32_t divide(uint32_t dividend, uint32_t divisor) {
  const int bits = std::countl_zero(divisor) - std::countl_zero(dividend) + 1;
  return divisor == 0 || bits <= 0 ? 2 : 2 + (static_cast<uint32_t>(bits) + 2) / 3 - (bits == 32 ? 1 : 0);
}

}  // namespace rotorloop::mcu::cost
