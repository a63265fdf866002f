// Is a sample a measurement? Three currents sum to zero and change no faster than the bus can drive them through the winding.
// A single sample that breaks both rules says nothing about the motor: it is replaced once by what the other two phases, or the
// turning frame, say. The second in a row opens the bridge. What the replacement says still meets the over-current limit, so a true
// current beyond the converter's range is never hidden: the two phases that can be measured carry it.
#pragma once
#include <cstdint>

#include "firmware/core/interface.hpp"
#include "firmware/core/motor/current_sense.hpp"

namespace rotorloop::firmware {

struct SampleCheckConfig {
  // |sum| that shunt and amplifier tolerances cannot explain: A, and share of |i|. Four gains 1 % apart at the range's end: 0.03.
  float sum_A = 0.0f, sum_share = 0.1f;
  float change_A_V = 0.0f;    // most change per sample and volt of bus: 1.5 T/L
  float alone_share = 0.13f;  // of it: a jump of one phase alone that no control makes
  bool bridge = true;         // false only to show what it prevents
};

enum class Sample : std::uint8_t { good, replaced, lost };

struct SampleCheckState {
  bool doubted = false;  // the sample before was replaced
};

// Phase whose value lies farthest from the expected one.
constexpr std::size_t farthest(const Phases& measured, const Phases& expected) {
  std::size_t worst = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (magnitude(measured[k] - expected[k]) > magnitude(measured[worst] - expected[worst])) worst = k;
  return worst;
}

// expected_A: the last current, turned with the frame. Changes `sensed` when it replaces a value.
constexpr Sample check_sample(const SampleCheckConfig& c, SampleCheckState& s, Sensed& sensed, Stator expected_A, float bus_V) {
  const Phases expected = inverse_clarke(expected_A);
  bool invalid = false;
  if (sensed.usable == 3) {
    const float size = magnitude(expected[0]) + magnitude(expected[1]) + magnitude(expected[2]);
    invalid = magnitude(sensed.residual_A) > c.sum_A + c.sum_share * size;
  } else if (sensed.usable == 2) {
    // No sum to look at. What the bus cannot drive through the winding is no current; nor is, at first, a jump of one phase that the
    // other does not share: of all directions in which a current can jump one in seven leaves that phase out.
    const std::size_t blind = sensed.blind, p = (blind + 1) % 3, q = (blind + 2) % 3;
    const float jump_p = magnitude(sensed.phase_A[p] - expected[p]), jump_q = magnitude(sensed.phase_A[q] - expected[q]);
    const float jump = jump_p > jump_q ? jump_p : jump_q, rest = jump_p > jump_q ? jump_q : jump_p;
    const float most = c.change_A_V * bus_V, alone = c.alone_share * most > c.sum_A ? c.alone_share * most : c.sum_A;
    invalid = (sensed.at_end_of_range && jump > most) || (jump > alone && rest < 0.25f * jump);
  }
  if (!invalid || !c.bridge) {
    s.doubted = false;
    return Sample::good;
  }
  if (s.doubted) return Sample::lost;
  s.doubted = true;
  if (sensed.usable == 3) {
    // Take back the share of the sum that each phase was charged with, then let the two others say the third.
    for (float& x : sensed.phase_A) x += sensed.residual_A * (1.0f / 3.0f);
    const std::size_t k = farthest(sensed.phase_A, expected);
    sensed.phase_A[k] -= sensed.residual_A;
    sensed.current_A = clarke(sensed.phase_A);
  } else {
    sensed.phase_A = expected;
    sensed.current_A = expected_A;
  }
  sensed.at_end_of_range = false;
  sensed.residual_A = 0.0f;
  return Sample::replaced;
}

// A slow quantity (bus, temperature): a jump is accepted when the next sample says it again.
struct SteadyValue {
  float value = 0.0f;
  bool doubted = false, begun = false;
};
constexpr float accept(SteadyValue& s, float sample, float jump) {
  const bool jumps = s.begun && magnitude(sample - s.value) > jump && !s.doubted;
  s.doubted = jumps;
  s.begun = true;
  if (!jumps) s.value = sample;
  return s.value;
}

constexpr float kSum_counts = 136.0f;  // twice the mean that opens the bridge (protection.hpp); tuned on the simulated drive, 2026-11-23

template <Board B>
constexpr void configure_sample_check(const Parameters& p, float period_s, SampleCheckConfig& c) {
  c.sum_A = kSum_counts * magnitude(B::kCurrent_A_per_count);
  c.change_A_V = 1.5f * period_s / p.inductance_H;
}

}  // namespace rotorloop::firmware
