// Conversions between single precision and integers, fixed point and half precision (FPToFixed, FixedToFP, FPHalfToSingle, FPSingleToHalf).
#include "sim/mcu/core/soft_float.hpp"
#include "sim/mcu/core/soft_float_number.hpp"

namespace rotorloop::mcu::fp {

uint32_t from_fixed(uint32_t value, uint32_t bits, uint32_t fraction, bool is_signed, Rounding mode, uint32_t& fpscr) {
  const uint32_t up = 32 - bits;
  const int64_t number =
      is_signed ? static_cast<int64_t>(static_cast<int32_t>(value << up) >> up) : static_cast<int64_t>(value << up >> up);
  if (number == 0) return 0;
  const auto magnitude = static_cast<uint64_t>(number < 0 ? -number : number);
  return round_to_single(normalised(number < 0, -static_cast<int>(fraction), magnitude), mode, fpscr);
}

uint32_t to_fixed(uint32_t a, uint32_t bits, uint32_t fraction, bool is_signed, Rounding mode, uint32_t& fpscr) {
  const Number n = unpack(a, fpscr);
  const int64_t highest = is_signed ? (int64_t{1} << (bits - 1)) - 1 : (int64_t{1} << bits) - 1;
  const int64_t lowest = is_signed ? -highest - 1 : 0;
  if (n.nan()) return invalid(fpscr) & 0;
  if (n.kind == Kind::zero) return 0;
  const int down = -(n.exponent + static_cast<int>(fraction));  // bits of the significand behind the point
  int64_t value = 0;
  bool inexact = false;
  if (n.kind == Kind::infinity || down < kTopBit - 34) {
    value = n.negative ? lowest - 1 : highest + 1;
  } else {
    const uint64_t whole = down > 63 ? 0 : n.significand >> down;
    const uint64_t rest = down > 63 ? 1 : n.significand & ((uint64_t{1} << down) - 1);  // beyond 63 it is less than a half
    const uint64_t half = down > 63 ? 2 : uint64_t{1} << (down - 1);
    value = static_cast<int64_t>(whole + (rounds_up(mode, n.negative, (whole & 1) != 0, rest, half) ? 1 : 0));
    if (n.negative) value = -value;
    inexact = rest != 0;
  }
  if (value > highest || value < lowest) {
    fpscr |= kInvalid;
    value = value > highest ? highest : lowest;
  } else if (inexact) {
    fpscr |= kInexact;
  }
  return static_cast<uint32_t>(value);
}

uint32_t from_half(uint32_t half, uint32_t& fpscr) {
  const bool negative = (half & 0x8000) != 0;
  const uint32_t exponent = half >> 10 & 31, fraction = half & 0x3FF;
  if (exponent == 31 && (fpscr & kAlternativeHalf) == 0) {
    if (fraction == 0) return signed_bits(negative, kInfinityBits);
    const uint32_t bits = signed_bits(negative, kInfinityBits | fraction << 13);
    return process_nan(bits, (fraction & 0x200) != 0 ? Kind::quiet_nan : Kind::signalling_nan, fpscr);
  }
  if (exponent == 0 && fraction == 0) return signed_bits(negative, 0);
  const Number n =
      exponent == 0 ? normalised(negative, -24, fraction) : normalised(negative, static_cast<int>(exponent) - 25, fraction | 0x400);
  return round_to_single(n, Rounding::nearest, fpscr);  // exact
}

namespace {

uint32_t round_to_half(const Number& n, uint32_t& fpscr) {
  constexpr int kRestBits = kTopBit - 10;
  const bool alternative = (fpscr & kAlternativeHalf) != 0;
  const uint32_t sign = n.negative ? 0x8000 : 0;
  const int exponent = n.exponent + kTopBit;
  const bool tiny = exponent < -14;
  const uint64_t significand = tiny ? shift_right_sticky(n.significand, -14 - exponent) : n.significand;
  const uint64_t rest = significand & ((uint64_t{1} << kRestBits) - 1);
  uint64_t kept = significand >> kRestBits;
  const Rounding mode = rounding(fpscr);
  if (rounds_up(mode, n.negative, (kept & 1) != 0, rest, uint64_t{1} << (kRestBits - 1))) ++kept;
  const int64_t bits = (tiny ? 0 : static_cast<int64_t>(exponent + 14) << 10) + static_cast<int64_t>(kept);
  if (alternative && bits > 0x7FFF) {
    fpscr |= kInvalid;
    return sign | 0x7FFF;
  }
  if (!alternative && bits >= 0x7C00) {
    fpscr |= kOverflow | kInexact;
    return sign | (overflows_to_infinity(mode, n.negative) ? 0x7C00 : 0x7BFF);
  }
  if (rest != 0) fpscr |= kInexact | (tiny ? kUnderflow : 0);
  return sign | static_cast<uint32_t>(bits);
}

}  // namespace

uint32_t to_half(uint32_t a, uint32_t& fpscr) {
  const Number n = unpack(a, fpscr);
  const bool alternative = (fpscr & kAlternativeHalf) != 0;
  const uint32_t sign = n.negative ? 0x8000 : 0;
  if (n.nan()) {
    if (alternative || n.kind == Kind::signalling_nan) fpscr |= kInvalid;
    if (alternative) return sign;
    return (fpscr & kDefaultNan) != 0 ? 0x7E00 : sign | 0x7E00 | (a >> 13 & 0x1FF);
  }
  if (n.kind == Kind::infinity) {
    if (alternative) fpscr |= kInvalid;
    return sign | (alternative ? 0x7FFF : 0x7C00);
  }
  return n.kind == Kind::zero ? sign : round_to_half(n, fpscr);
}

}  // namespace rotorloop::mcu::fp
