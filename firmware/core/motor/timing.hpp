// The beat of the motor control on a board, and times made into numbers of samples and shares per sample.
#pragma once
#include <cstdint>

#include "firmware/board/board.hpp"

namespace rotorloop::firmware {

// The RPM loop and all supervision run once every kSlots samples, each job in its own sample so that no interrupt is long.
constexpr std::uint32_t kSlots = 6;

template <Board B>
constexpr float sample_s() {
  return static_cast<float>(B::kPwmPeriodsPerSample) / static_cast<float>(B::kPwm_Hz);
}

// Highest duty that leaves the current sample its window: half of the low side's time lies before the sample.
template <Board B>
constexpr float sample_duty() {
  const float pwm_s = 1.0f / static_cast<float>(B::kPwm_Hz), dead_s = 1e-9f * static_cast<float>(B::kDeadTime_ns);
  return 1.0f - (2e-9f * static_cast<float>(B::kSampleWindow_ns) + dead_s) / pwm_s;
}

// exp(-x) for 0 <= x <= 8, Padé (2,2) of an eighth: error below 1e-5.
constexpr float exp_minus(float x) {
  const float z = 0.125f * (x < 8.0f ? x : 8.0f);
  const float y = (1.0f - 0.5f * z + z * z * (1.0f / 12)) / (1.0f + 0.5f * z + z * z * (1.0f / 12));
  const float y2 = y * y, y4 = y2 * y2;
  return y4 * y4;
}

constexpr std::uint16_t ticks(float seconds, float tick_s) {
  const float n = seconds / tick_s + 0.5f;
  return static_cast<std::uint16_t>(n < 1.0f ? 1.0f : n > 60000.0f ? 60000.0f : n);
}

}  // namespace rotorloop::firmware
