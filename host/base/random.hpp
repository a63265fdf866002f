// Random numbers that depend on (seed, module, sample number) alone: a module that draws more does not shift the numbers of
// another, and a run repeats bit by bit on any machine. No std distribution is used: their algorithms differ by library.
#pragma once
#include <cmath>
#include <cstdint>

#include "host/base/elementary.hpp"

namespace rotorloop {

class RandomStream {
 public:
  // `module` names the user (one constant per sensor, ESC, …); two streams with another seed or module are unrelated.
  constexpr RandomStream(std::uint64_t seed, std::uint64_t module) : key_(mix(seed ^ mix(module + 0x9E3779B97F4A7C15ull))) {}

  constexpr std::uint64_t bits(std::uint64_t sample) const { return mix(key_ + sample * 0x9E3779B97F4A7C15ull); }
  // Uniform in [0, 1).
  constexpr double uniform(std::uint64_t sample) const { return as_double(bits(sample) >> 11) * 0x1p-53; }
  // Standard normal, exact in distribution (Box-Muller over two independent words).
  double gaussian(std::uint64_t sample) const {
    const double u = (as_double(mix(key_ + sample * 0x9E3779B97F4A7C15ull + 0x5851F42D4C957F2Dull) >> 11) + 1.0) * 0x1p-53;
    return std::sqrt(-2.0 * log_exact(u)) * cos_exact(6.28318530717958647692 * uniform(sample));
  }
  // Standard normal for fast loops: sum of the 64 bits of one word (binomial, kurtosis 2.97, steps of 0.25 sigma) plus a
  // uniform dither of one step, scaled to variance 1. Good for ADC noise, wrong for tails beyond 5 sigma.
  constexpr double quick_gaussian(std::uint64_t sample) const {
    const std::uint64_t w = bits(sample);
    const double steps = static_cast<double>(set_bits(w)) - 32.0;   // variance 16
    const double dither = as_double(mix(w) >> 11) * 0x1p-53 - 0.5;  // variance 1/12
    return (steps + dither) * 0.24935;                              // 1/sqrt(16 + 1/12)
  }

 private:
  // Stafford's variant 13 of the 64-bit finaliser of MurmurHash3 (as in SplitMix64).
  static constexpr std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }
  // Of less than 2^63: a signed conversion is one instruction, an unsigned one is not.
  static constexpr double as_double(std::uint64_t w) { return static_cast<double>(static_cast<std::int64_t>(w)); }
  // Sums in fields of 2, 4, 8 bits, then one multiplication: the builtin is a call on a CPU that may lack the instruction.
  static constexpr int set_bits(std::uint64_t w) {
    w -= (w >> 1) & 0x5555555555555555ull;
    w = (w & 0x3333333333333333ull) + ((w >> 2) & 0x3333333333333333ull);
    w = (w + (w >> 4)) & 0x0F0F0F0F0F0F0F0Full;
    return static_cast<int>((w * 0x0101010101010101ull) >> 56);
  }
  std::uint64_t key_;
};

}  // namespace rotorloop
