// The arithmetic operations.
#include "sim/mcu/core/soft_float.hpp"

#include <utility>

#include "sim/mcu/core/soft_float_number.hpp"

namespace rotorloop::mcu::fp {

namespace {

// FPProcessNaNs: a signalling NaN before a quiet one, the first before the second. False: none of them is a NaN.
bool take_nan(uint32_t a, const Number& na, uint32_t b, const Number& nb, uint32_t& result, uint32_t& fpscr) {
  if (!na.nan() && !nb.nan()) return false;
  const bool first = na.kind == Kind::signalling_nan || (nb.kind != Kind::signalling_nan && na.nan());
  result = first ? process_nan(a, na.kind, fpscr) : process_nan(b, nb.kind, fpscr);
  return true;
}

// The exact sum of two finite numbers, with a sticky lowest bit. Both are normalised: what is lost by aligning cannot come back by
// cancellation.
uint32_t sum(Number a, Number b, uint32_t& fpscr) {
  if (a.exponent < b.exponent) std::swap(a, b);
  const uint64_t aligned = shift_right_sticky(b.significand, a.exponent - b.exponent);
  if (a.negative == b.negative) return round_to_single(normalised(a.negative, a.exponent, a.significand + aligned), rounding(fpscr), fpscr);
  const bool smaller = a.significand < aligned;
  const uint64_t difference = smaller ? aligned - a.significand : a.significand - aligned;
  if (difference == 0) return signed_bits(rounding(fpscr) == Rounding::down, 0);
  return round_to_single(normalised(smaller ? b.negative : a.negative, a.exponent, difference), rounding(fpscr), fpscr);
}

uint32_t sum_of_zeros(bool first, bool second, uint32_t fpscr) {
  return signed_bits(first == second ? first : rounding(fpscr) == Rounding::down, 0);
}

// Two significands with bit kTopBit set: their product has up to 124 bits, of which 24 each are not zero when they come from operands.
Number product(const Number& a, const Number& b) {
  constexpr int kDown = kTopBit - 23;
  return normalised(a.negative != b.negative, a.exponent + b.exponent + 2 * kDown, (a.significand >> kDown) * (b.significand >> kDown));
}

uint64_t integer_root(uint64_t value) {
  uint64_t root = 0;
  for (uint64_t bit = uint64_t{1} << 31; bit != 0; bit >>= 1) {
    if ((root | bit) * (root | bit) <= value) root |= bit;
  }
  return root;
}

// Sign of the second operand changed after NaNs were looked at: a NaN that is subtracted keeps its sign.
uint32_t add_or_subtract(uint32_t a, uint32_t b, bool subtracts, uint32_t& fpscr) {
  const Number na = unpack(a, fpscr);
  Number nb = unpack(b, fpscr);
  uint32_t nan = 0;
  if (take_nan(a, na, b, nb, nan, fpscr)) return nan;
  nb.negative = nb.negative != subtracts;
  const bool a_infinite = na.kind == Kind::infinity, b_infinite = nb.kind == Kind::infinity;
  if (a_infinite && b_infinite && na.negative != nb.negative) return invalid(fpscr);
  if (a_infinite || b_infinite) return signed_bits(a_infinite ? na.negative : nb.negative, kInfinityBits);
  if (na.kind == Kind::zero && nb.kind == Kind::zero) return sum_of_zeros(na.negative, nb.negative, fpscr);
  if (na.kind == Kind::zero) return round_to_single(nb, rounding(fpscr), fpscr);
  if (nb.kind == Kind::zero) return round_to_single(na, rounding(fpscr), fpscr);
  return sum(na, nb, fpscr);
}

}  // namespace

uint32_t add(uint32_t a, uint32_t b, uint32_t& fpscr) { return add_or_subtract(a, b, false, fpscr); }
uint32_t subtract(uint32_t a, uint32_t b, uint32_t& fpscr) { return add_or_subtract(a, b, true, fpscr); }

uint32_t multiply(uint32_t a, uint32_t b, uint32_t& fpscr) {
  const Number na = unpack(a, fpscr), nb = unpack(b, fpscr);
  uint32_t nan = 0;
  if (take_nan(a, na, b, nb, nan, fpscr)) return nan;
  const bool negative = na.negative != nb.negative, infinite = na.kind == Kind::infinity || nb.kind == Kind::infinity;
  const bool zero = na.kind == Kind::zero || nb.kind == Kind::zero;
  if (infinite && zero) return invalid(fpscr);
  if (infinite) return signed_bits(negative, kInfinityBits);
  if (zero) return signed_bits(negative, 0);
  return round_to_single(product(na, nb), rounding(fpscr), fpscr);
}

uint32_t divide(uint32_t a, uint32_t b, uint32_t& fpscr) {
  const Number na = unpack(a, fpscr), nb = unpack(b, fpscr);
  uint32_t nan = 0;
  if (take_nan(a, na, b, nb, nan, fpscr)) return nan;
  const bool negative = na.negative != nb.negative;
  if (na.kind == nb.kind && na.kind != Kind::finite) return invalid(fpscr);  // zero by zero, infinity by infinity
  if (na.kind == Kind::infinity) return signed_bits(negative, kInfinityBits);
  if (nb.kind == Kind::zero) {
    fpscr |= kDivideByZero;
    return signed_bits(negative, kInfinityBits);
  }
  if (na.kind == Kind::zero || nb.kind == Kind::infinity) return signed_bits(negative, 0);
  const uint64_t divisor = nb.significand >> (kTopBit - 23);  // 24 bits, exact
  const uint64_t quotient = na.significand / divisor, sticky = quotient * divisor != na.significand ? 1 : 0;
  return round_to_single(normalised(negative, na.exponent - nb.exponent - (kTopBit - 23) - 1, quotient << 1 | sticky), rounding(fpscr),
                         fpscr);
}

uint32_t square_root(uint32_t a, uint32_t& fpscr) {
  const Number n = unpack(a, fpscr);
  if (n.nan()) return process_nan(a, n.kind, fpscr);
  if (n.kind == Kind::zero) return signed_bits(n.negative, 0);
  if (n.negative) return invalid(fpscr);
  if (n.kind == Kind::infinity) return a;
  const bool odd = (n.exponent & 1) != 0;
  const uint64_t value = odd ? n.significand << 1 : n.significand, root = integer_root(value);
  const int exponent = (odd ? n.exponent - 1 : n.exponent) / 2;
  return round_to_single(normalised(false, exponent - 1, root << 1 | (root * root != value ? 1 : 0)), rounding(fpscr), fpscr);
}

namespace {

// FPProcessNaNs3, and the case of a quiet NaN added to infinity times zero.
bool take_nan_of_three(const uint32_t (&bits)[3], const Number (&n)[3], bool invalid_product, uint32_t& result, uint32_t& fpscr) {
  for (const Kind kind : {Kind::signalling_nan, Kind::quiet_nan}) {
    for (int i = 0; i < 3; ++i) {
      if (n[i].kind != kind) continue;
      result = i == 0 && kind == Kind::quiet_nan && invalid_product ? invalid(fpscr) : process_nan(bits[i], kind, fpscr);
      return true;
    }
  }
  return false;
}

}  // namespace

uint32_t multiply_add(uint32_t addend, uint32_t a, uint32_t b, uint32_t& fpscr) {
  const uint32_t bits[3] = {addend, a, b};
  const Number n[3] = {unpack(addend, fpscr), unpack(a, fpscr), unpack(b, fpscr)};
  const bool infinite = n[1].kind == Kind::infinity || n[2].kind == Kind::infinity,
             zero = n[1].kind == Kind::zero || n[2].kind == Kind::zero;
  uint32_t nan = 0;
  if (take_nan_of_three(bits, n, infinite && zero, nan, fpscr)) return nan;
  const bool negative = n[1].negative != n[2].negative;
  if (infinite && zero) return invalid(fpscr);
  if (infinite && n[0].kind == Kind::infinity && n[0].negative != negative) return invalid(fpscr);
  if (infinite) return signed_bits(negative, kInfinityBits);
  if (n[0].kind == Kind::infinity) return addend;
  if (zero && n[0].kind == Kind::zero) return sum_of_zeros(n[0].negative, negative, fpscr);
  if (zero) return round_to_single(n[0], rounding(fpscr), fpscr);
  const Number exact = product(n[1], n[2]);
  if (n[0].kind == Kind::zero) return round_to_single(exact, rounding(fpscr), fpscr);
  return sum(n[0], exact, fpscr);
}

uint32_t compare(uint32_t a, uint32_t b, bool signal_all, uint32_t& fpscr) {
  const Number na = unpack(a, fpscr), nb = unpack(b, fpscr);
  if (na.nan() || nb.nan()) {
    if (signal_all || na.kind == Kind::signalling_nan || nb.kind == Kind::signalling_nan) fpscr |= kInvalid;
    return 0x30000000;
  }
  // Flushed operands are zeros; what is left orders like integers of sign and magnitude.
  const int64_t ma = na.kind == Kind::zero ? 0 : static_cast<int64_t>(a & 0x7FFFFFFF),
                mb = nb.kind == Kind::zero ? 0 : static_cast<int64_t>(b & 0x7FFFFFFF);
  const int64_t va = na.negative ? -ma : ma, vb = nb.negative ? -mb : mb;
  if (va == vb) return 0x60000000;
  return va < vb ? 0x80000000 : 0x20000000;
}

}  // namespace rotorloop::mcu::fp
