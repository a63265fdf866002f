// Rounding.
#include "sim/mcu/core/soft_float_number.hpp"

namespace rotorloop::mcu::fp {

uint32_t round_to_single(const Number& number, Rounding mode, uint32_t& fpscr) {
  constexpr int kRestBits = kTopBit - 23;
  const bool negative = number.negative;
  const int exponent = number.exponent + kTopBit;  // of the leading bit
  const bool tiny = exponent < -126;
  if (tiny && (fpscr & kFlushToZero) != 0) {
    fpscr |= kUnderflow;
    return signed_bits(negative, 0);
  }
  const uint64_t significand = tiny ? shift_right_sticky(number.significand, -126 - exponent) : number.significand;
  const uint64_t rest = significand & ((uint64_t{1} << kRestBits) - 1);
  uint64_t kept = significand >> kRestBits;
  if (rounds_up(mode, negative, (kept & 1) != 0, rest, uint64_t{1} << (kRestBits - 1))) ++kept;
  // The leading bit of `kept` adds one to the exponent field, as does a carry out of it.
  const int64_t bits = (tiny ? 0 : static_cast<int64_t>(exponent + 126) << 23) + static_cast<int64_t>(kept);
  if (bits >= kInfinityBits) {
    fpscr |= kOverflow | kInexact;
    return signed_bits(negative, overflows_to_infinity(mode, negative) ? kInfinityBits : kInfinityBits - 1);
  }
  if (rest != 0) fpscr |= kInexact | (tiny ? kUnderflow : 0);
  return signed_bits(negative, static_cast<uint32_t>(bits));
}

}  // namespace rotorloop::mcu::fp
