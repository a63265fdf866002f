// Elementary functions whose bits do not depend on the C library or the CPU: glibc picks FMA variants of sin, exp and log
// at run time, which would make two machines disagree in a lockstep run. Only +, -, *, / and sqrt (all exactly rounded by
// IEEE 754) are used here, and the build forbids contraction (-ffp-contract=off). Errors are a few ulp; see the unit test.
#pragma once
#include <bit>
#include <cmath>  // sqrt, floor, isfinite: exact on every CPU
#include <cstdint>
#include <limits>
#include <numbers>

namespace rotorloop {

struct SinCos {
  double sin;
  double cos;
};

namespace detail {
inline double exact_floor(double x) { return std::floor(x); }
}  // namespace detail

// |x| up to about 1e6 rad keeps full accuracy (three-part reduction by π/2).
inline SinCos sincos_exact(double x_rad) {
  constexpr double kTwoOverPi = 0.63661977236758134308;
  // π/2 in three parts of 33 bits, so that k * part is exact for |k| < 2^20.
  constexpr double kP1 = 1.57079632673412561417e+00, kP2 = 6.07710050630396597660e-11, kP3 = 2.02226624879595063154e-21;
  const double k = detail::exact_floor(x_rad * kTwoOverPi + 0.5);
  const double r = ((x_rad - k * kP1) - k * kP2) - k * kP3;
  const double z = r * r;
  // Taylor series on |r| <= π/4: the first omitted terms are below 1e-18.
  double s = 1.0 / 355687428096000.0;  // 1/17!
  s = s * z - 1.0 / 1307674368000.0;   // 1/15!
  s = s * z + 1.0 / 6227020800.0;
  s = s * z - 1.0 / 39916800.0;
  s = s * z + 1.0 / 362880.0;
  s = s * z - 1.0 / 5040.0;
  s = s * z + 1.0 / 120.0;
  s = s * z - 1.0 / 6.0;
  const double sine = r + r * (z * s);
  double c = 1.0 / 20922789888000.0;  // 1/16!
  c = c * z - 1.0 / 87178291200.0;
  c = c * z + 1.0 / 479001600.0;
  c = c * z - 1.0 / 3628800.0;
  c = c * z + 1.0 / 40320.0;
  c = c * z - 1.0 / 720.0;
  c = c * z + 1.0 / 24.0;
  const double cosine = 1.0 - (0.5 * z - z * z * c);
  switch (static_cast<std::int64_t>(k) & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}
inline double sin_exact(double x_rad) { return sincos_exact(x_rad).sin; }
inline double cos_exact(double x_rad) { return sincos_exact(x_rad).cos; }

// atan(x): halved once (tan(a/2) = t / (1 + sqrt(1 + t²))) after folding into [0, tan π/8], then its series.
inline double atan_exact(double x) {
  if (std::isnan(x)) return x;
  const double a = x < 0 ? -x : x;
  const bool inverted = a > 1.0;
  double t = inverted ? 1.0 / a : a;            // [0, 1]
  const bool folded = t > 0.41421356237309503;  // tan(π/8)
  if (folded) t = (t - 1.0) / (t + 1.0);        // atan t = π/4 + atan((t-1)/(t+1))
  t = t / (1.0 + std::sqrt(1.0 + t * t));
  const double z = t * t;  // <= 0.0396
  double p = 0.0;
  for (int n = 25; n >= 3; n -= 2) p = z * ((n & 2 ? -1.0 : 1.0) / n + p);
  double angle = 2.0 * (t + t * p);
  if (folded) angle += std::numbers::pi / 4;
  if (inverted) angle = std::numbers::pi / 2 - angle;
  return x < 0 ? -angle : angle;
}

inline double atan2_exact(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) return std::numeric_limits<double>::quiet_NaN();
  if (x == 0.0 && y == 0.0) return std::signbit(x) ? std::copysign(std::numbers::pi, y) : y;
  if ((x < 0 ? -x : x) >= (y < 0 ? -y : y)) {
    const double a = atan_exact(y / x);
    if (x > 0) return a;
    return std::signbit(y) ? a - std::numbers::pi : a + std::numbers::pi;
  }
  const double a = atan_exact(x / y);
  return y > 0 ? std::numbers::pi / 2 - a : -std::numbers::pi / 2 - a;
}

inline double asin_exact(double x) { return atan2_exact(x, std::sqrt((1.0 - x) * (1.0 + x))); }
inline double acos_exact(double x) { return atan2_exact(std::sqrt((1.0 - x) * (1.0 + x)), x); }

// exp(x) for -700 <= x <= 700; beyond that 0 or infinity.
inline double exp_exact(double x) {
  if (std::isnan(x)) return x;
  if (x > 709.0) return std::numeric_limits<double>::infinity();
  if (x < -700.0) return 0.0;
  constexpr double kLn2Hi = 6.93147180369123816490e-01, kLn2Lo = 1.90821492927058770002e-10;
  const double k = detail::exact_floor(x * 1.44269504088896340736 + 0.5);
  const double r = (x - k * kLn2Hi) - k * kLn2Lo;
  double p = 1.0;
  for (int n = 14; n >= 1; --n) p = 1.0 + r * p / n;
  const auto scale = std::bit_cast<double>(static_cast<std::uint64_t>(static_cast<std::int64_t>(k) + 1023) << 52);
  return p * scale;
}

// Natural logarithm of a normal positive number; NaN below zero, -infinity at zero.
inline double log_exact(double x) {
  if (std::isnan(x) || x < 0) return std::numeric_limits<double>::quiet_NaN();
  if (x == 0) return -std::numeric_limits<double>::infinity();
  if (std::isinf(x)) return x;
  int exponent = 0;
  if (x < std::numeric_limits<double>::min()) {
    x *= 0x1p54;
    exponent = -54;
  }
  const auto bits = std::bit_cast<std::uint64_t>(x);
  exponent += static_cast<int>(bits >> 52) - 1023;
  double m = std::bit_cast<double>((bits & 0x000FFFFFFFFFFFFFull) | 0x3FF0000000000000ull);
  if (m > std::numbers::sqrt2) {
    m *= 0.5;
    ++exponent;
  }
  const double s = (m - 1.0) / (m + 1.0);  // |s| <= 0.1716
  const double z = s * s;
  double p = 0.0;
  for (int n = 23; n >= 3; n -= 2) p = z * (1.0 / n + p);
  constexpr double kLn2Hi = 6.93147180369123816490e-01, kLn2Lo = 1.90821492927058770002e-10;
  return exponent * kLn2Hi + (2.0 * (s + s * p) + exponent * kLn2Lo);
}

inline double pow_exact(double base, double exponent) { return exp_exact(exponent * log_exact(base)); }

}  // namespace rotorloop
