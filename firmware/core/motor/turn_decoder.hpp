// Has somebody turned the rotor once round? With all low sides on, a rotor that is turned drives a current that turns with it through the
// shunts. It is read like a quadrature encoder: the signs of its two components, with hysteresis, step through four quadrants per
// electrical turn, always in the same order. Noise, drifting zeros, a shove that swings back and a rotor that is only bumped
// step to and fro, or not at all; a hand steps on in one sense.
// Works on converter counts: what an ampere is does not matter, nor does the sign of the amplifiers.
#pragma once
#include <cstdint>

#include "firmware/core/motor/vector.hpp"

namespace rotorloop::firmware {

struct TurnConfig {
  static constexpr std::uint32_t kBlocks_Hz = 1000;  // means of the current, one each millisecond
  float least_counts = 2.0f;                         // hysteresis: six times the noise of a block of 24 samples of 2 counts rms
  float slow_share = 0.007f;                         // per block, of what is taken for the zeros: 1 rad/s of the shaft with 7 pole pairs
  std::uint16_t most_blocks = 74;                    // from one step to the next: a quadrant at 3 rad/s of the shaft with 7 pole pairs
  std::uint16_t steps = 31;                          // that say yes: a whole turn and three, as one less than a turn makes 29 at most
};

constexpr TurnConfig configure_turn(std::uint8_t pole_pairs) {
  const float pairs = pole_pairs > 0 ? static_cast<float>(pole_pairs) : 1.0f;
  constexpr float kSlow_rad_s = 1.0f, kSlowest_rad_s = 3.0f, kBlock_s = 1.0f / static_cast<float>(TurnConfig::kBlocks_Hz);
  TurnConfig c;
  c.slow_share = kSlow_rad_s * pairs * kBlock_s;
  c.most_blocks = static_cast<std::uint16_t>(0.5f * kPi / (kSlowest_rad_s * pairs * kBlock_s));
  c.steps = static_cast<std::uint16_t>(4.0f * pairs + 3.0f);
  return c;
}

struct TurnState {
  Stator slow_counts{};
  std::int32_t sign_a = 0, sign_b = 0;  // 0: not yet seen
  std::int32_t steps = 0;               // in a row, signed by their sense
  std::uint32_t since = 0;              // blocks since the last one
  bool begun = false;
};

// `counts`: mean of one block. True: a whole turn in one sense.
constexpr bool step(const TurnConfig& c, TurnState& s, Stator counts) {
  if (!s.begun) {
    s.slow_counts = counts;
    s.begun = true;
  }
  s.slow_counts = s.slow_counts + c.slow_share * (counts - s.slow_counts);
  const Stator v = counts - s.slow_counts;
  const auto sign = [&](float x, std::int32_t before) { return x > c.least_counts ? 1 : x < -c.least_counts ? -1 : before; };
  const std::int32_t a = sign(v.a, s.sign_a), b = sign(v.b, s.sign_b);
  const bool first = s.sign_a == 0 || s.sign_b == 0, moved_a = a != s.sign_a, moved_b = b != s.sign_b;
  s.sign_a = a;
  s.sign_b = b;
  if (first || (moved_a && moved_b)) {
    s.steps = 0;
  } else if (moved_a || moved_b) {
    const std::int32_t sense = moved_a ? -a * b : a * b;
    s.steps = s.steps * sense > 0 ? s.steps + sense : sense;
    s.since = 0;
  } else if (++s.since > c.most_blocks) {
    s.steps = 0;
  }
  return (s.steps < 0 ? -s.steps : s.steps) >= c.steps;
}

}  // namespace rotorloop::firmware
