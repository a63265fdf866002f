// Counts of three low-side shunts to phase currents: zeros measured whenever the bridge is off and followed while it switches, and
// reconstruction from the two best phases when the third had its low side on too briefly for the amplifier to settle.
#pragma once
#include <array>
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/core/motor/timing.hpp"
#include "firmware/core/motor/vector.hpp"

namespace rotorloop::firmware {

struct SenseConfig {
  float A_per_count = 0.0f;
  float zero_counts = 0.0f, zero_tolerance_counts = 0.0f;
  std::uint16_t blind_compare = 0;  // a compare above it leaves no settled sample
  std::uint16_t zero_compare = 0;   // a compare below it leaves no settled zero
  float zero_rate = 0.0f;           // of following it, per look
  std::uint16_t rest_samples = 0;   // after the bridge went off, for currents and amplifiers to come to rest
};

struct SenseState {
  static constexpr std::uint32_t kCalibrationSamples = 256;
  static constexpr std::uint16_t kMostSpread = 40;  // counts; noise spreads over 16, a current through the diodes over more
  std::array<std::uint32_t, 3> sum{};
  std::array<std::uint16_t, 3> lowest{}, highest{};
  Phases zero_counts{};
  std::uint32_t samples = 0;
  std::uint16_t rest = 0;  // samples to wait
  bool calibrated = false;
  bool zero_out_of_tolerance = false;
};

struct Sensed {
  Phases phase_A{};
  Stator current_A{};
  float residual_A = 0.0f;       // sum of the three when all were valid
  std::uint8_t usable = 3;       // phases whose sample was valid
  std::uint8_t blind = 0;        // the one that was not, with two usable
  bool at_end_of_range = false;  // a valid phase at the converter's end: current unknown, beyond range
};

// With the bridge off no phase carries current: the zero is averaged again and again, so that each start begins with one that is at most a
// block old: amplifiers drift by some 10 counts as the board warms up. A block that something disturbed counts for nothing.
[[gnu::noinline]] constexpr void calibrate_zero(const SenseConfig& c, SenseState& s, const AdcCounts& adc) {
  if (s.zero_out_of_tolerance) return;
  if (s.rest > 0) {
    --s.rest;
    return;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint16_t x = adc.phase[k];
    s.sum[k] = s.samples == 0 ? x : s.sum[k] + x;
    s.lowest[k] = s.samples == 0 || x < s.lowest[k] ? x : s.lowest[k];
    s.highest[k] = s.samples == 0 || x > s.highest[k] ? x : s.highest[k];
  }
  if (++s.samples < SenseState::kCalibrationSamples) return;
  s.samples = 0;
  for (std::size_t k = 0; k < 3; ++k)
    if (s.highest[k] - s.lowest[k] > SenseState::kMostSpread) return;
  s.calibrated = true;
  for (std::size_t k = 0; k < 3; ++k) {
    s.zero_counts[k] = static_cast<float>(s.sum[k]) * (1.0f / SenseState::kCalibrationSamples);
    if (magnitude(s.zero_counts[k] - c.zero_counts) > c.zero_tolerance_counts) s.zero_out_of_tolerance = true;
  }
  if (s.zero_out_of_tolerance) s.calibrated = false;
}

constexpr float kMostOff_counts = 16.0f;  // eight standard deviations of the noise

// While the bridge switches, a phase whose high side is on for long enough shows its zero once a period. What is far from the one known is
// no zero but a spoilt conversion.
constexpr void follow_zero(const SenseConfig& c, float& zero_counts, std::uint16_t unloaded, std::uint16_t compare) {
  const float off = static_cast<float>(unloaded) - zero_counts;
  if (compare >= c.zero_compare && magnitude(off) < kMostOff_counts) zero_counts += c.zero_rate * off;
}

// The bridge is driven: the next calibration begins anew after it.
constexpr void disturb_zero(const SenseConfig& c, SenseState& s) {
  s.rest = c.rest_samples;
  s.samples = 0;
}

// `compare`: what was active in the period before the sample.
constexpr Sensed sense_currents(const SenseConfig& c, const SenseState& s, const AdcCounts& adc, const PwmCompare& compare) {
  Sensed out;
  std::uint8_t blind = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    out.phase_A[k] = (static_cast<float>(adc.phase[k]) - s.zero_counts[k]) * c.A_per_count;
    const bool valid = compare.phase[k] <= c.blind_compare;
    if (!valid) ++blind;
    if (valid && (adc.phase[k] >= 4094 || adc.phase[k] <= 1)) out.at_end_of_range = true;
  }
  out.usable = static_cast<std::uint8_t>(3 - blind);
  if (blind == 0) {
    // All three: take out the common error, a third each. The sum is kept as a health check.
    out.residual_A = out.phase_A[0] + out.phase_A[1] + out.phase_A[2];
    const float third = out.residual_A * (1.0f / 3.0f);
    for (float& x : out.phase_A) x -= third;
  } else {
    std::size_t widest = 0;
    for (std::size_t k = 1; k < 3; ++k) {
      if (compare.phase[k] > compare.phase[widest]) widest = k;
    }
    const std::size_t p = (widest + 1) % 3, q = (widest + 2) % 3;
    out.blind = static_cast<std::uint8_t>(widest);
    out.phase_A[widest] = -(out.phase_A[p] + out.phase_A[q]);
  }
  out.current_A = clarke(out.phase_A);
  return out;
}

// Tuned on the simulated drive: the zero's rate 2026-11-26 (docs/decisions/0157), the rest 2026-11-23.
constexpr float kZeroRate_1_s = 40.0f, kSenseRest_s = 0.005f;

template <Board B>
constexpr SenseConfig configure_sense(float period_s) {
  const float duty = sample_duty<B>(), top = static_cast<float>(B::kPwmTop);
  return {B::kCurrent_A_per_count,
          B::kCurrentZero_counts,
          B::kCurrentZeroTolerance_counts,
          static_cast<std::uint16_t>(duty * top),
          static_cast<std::uint16_t>((1.0f - duty) * top),  // the same time, seen from the other end
          kZeroRate_1_s * static_cast<float>(kSlots) * period_s,
          ticks(kSenseRest_s, period_s)};
}

}  // namespace rotorloop::firmware
