// Numbers taken apart and put together again: what all operations of soft_float*.cpp share.
#pragma once
#include <bit>
#include <cstdint>

#include "sim/mcu/core/fpscr.hpp"

namespace rotorloop::mcu::fp {

inline constexpr uint32_t kDefaultNanBits = 0x7FC00000, kInfinityBits = 0x7F800000;
inline constexpr int kTopBit = 61;  // of a significand that is not zero: two bits are left for carries

enum class Kind : uint8_t { zero, finite, infinity, quiet_nan, signalling_nan };

struct Number {
  Kind kind = Kind::zero;
  bool negative = false;
  int exponent = 0;          // value = significand * 2^exponent
  uint64_t significand = 0;  // normalised: bit kTopBit is set
  bool nan() const { return kind == Kind::quiet_nan || kind == Kind::signalling_nan; }
};

// A shift to the right that keeps in the lowest bit whether anything was lost.
inline uint64_t shift_right_sticky(uint64_t value, int by) {
  if (by <= 0) return value;
  if (by > 63) return value != 0 ? 1 : 0;
  return value >> by | ((value & ((uint64_t{1} << by) - 1)) != 0 ? 1 : 0);
}

inline Number normalised(bool negative, int exponent, uint64_t significand) {
  if (significand == 0) return {Kind::zero, negative, 0, 0};
  const int up = kTopBit - (63 - std::countl_zero(significand));
  const uint64_t moved = up >= 0 ? significand << up : shift_right_sticky(significand, -up);
  return {Kind::finite, negative, exponent - up, moved};
}

// FPUnpack: with FZ a denormal operand is zero, and IDC.
inline Number unpack(uint32_t bits, uint32_t& fpscr) {
  const bool negative = bits >> 31 != 0;
  const uint32_t exponent = bits >> 23 & 0xFF, fraction = bits & 0x7FFFFF;
  if (exponent == 255) {
    const Kind nan = (fraction & 0x400000) != 0 ? Kind::quiet_nan : Kind::signalling_nan;
    return {fraction == 0 ? Kind::infinity : nan, negative, 0, 0};
  }
  if (exponent != 0)
    return {Kind::finite, negative, static_cast<int>(exponent) - 127 - kTopBit, (uint64_t{fraction} | 0x800000) << (kTopBit - 23)};
  if (fraction != 0 && (fpscr & kFlushToZero) != 0) {
    fpscr |= kInputDenormal;
    return {Kind::zero, negative, 0, 0};
  }
  return normalised(negative, -149, fraction);
}

inline uint32_t signed_bits(bool negative, uint32_t magnitude) { return (negative ? 0x80000000u : 0) | magnitude; }

// Whether the part below the last bit makes the magnitude one larger.
inline bool rounds_up(Rounding mode, bool negative, bool odd, uint64_t rest, uint64_t half) {
  switch (mode) {
    case Rounding::nearest:
      return rest > half || (rest == half && odd);
    case Rounding::up:
      return rest != 0 && !negative;
    case Rounding::down:
      return rest != 0 && negative;
    default:
      return false;
  }
}

inline bool overflows_to_infinity(Rounding mode, bool negative) {
  return mode == Rounding::nearest || (mode == Rounding::up && !negative) || (mode == Rounding::down && negative);
}

// FPRound: significand * 2^exponent, its lowest bit sticky, to single precision. Tiny is what is tiny before rounding.
uint32_t round_to_single(const Number& number, Rounding mode, uint32_t& fpscr);

// FPProcessNaN: made quiet; invalid when it signalled.
inline uint32_t process_nan(uint32_t bits, Kind kind, uint32_t& fpscr) {
  if (kind == Kind::signalling_nan) fpscr |= kInvalid;
  return (fpscr & kDefaultNan) != 0 ? kDefaultNanBits : bits | 0x400000;
}

inline uint32_t invalid(uint32_t& fpscr) {
  fpscr |= kInvalid;
  return kDefaultNanBits;
}

}  // namespace rotorloop::mcu::fp
