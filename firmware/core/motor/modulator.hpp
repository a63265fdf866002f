// Voltage vector to compare values: space-vector modulation by common-mode injection, dead-time compensation, and room for the
// current samples. Says which voltage the motor then really sees, for the observer.
#pragma once
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/core/motor/motor_scale.hpp"
#include "firmware/core/motor/timing.hpp"
#include "firmware/core/motor/vector.hpp"

namespace rotorloop::firmware {

struct ModulatorConfig {
  float top = 1.0f, over_top = 1.0f;  // compare of full duty
  float dead_share = 0.0f;            // dead time / PWM period, as the board says; what is learned replaces it (dead_time.hpp)
  float diode_drop_V = 0.0f;
  // Around zero current the lost voltage is taken as proportional: up to the current that moves the switch node within the dead time, and
  // half the ripple, which grows with the voltage: the node is moved by the current at the edge, not by the mean one.
  float zone_A = 1.0f, ripple_A_V = 0.0f;
  float sample_duty = 1.0f;  // highest duty that leaves the current sample its window
};

struct Modulated {
  PwmCompare compare{};
  // Motor voltage = bus × duty − lost; kept apart because the bus of the coming period is only known when it is sampled.
  Stator duty{};
  Stator lost_V{};
};

// Longest voltage vector that the modulator can make in every direction after dead time: bus·(1 − 2·dead share)/√3.
constexpr float voltage_limit_V(const ModulatorConfig& c, float bus_V) {
  return (bus_V * (1.0f - 2.0f * c.dead_share) - 2.0f * c.dead_share * c.diode_drop_V) * (1.0f / kRoot3);
}

// `current_A`: expected while the voltage acts (only its signs matter). `dead_share`: dead time / PWM period.
constexpr Modulated modulate(const ModulatorConfig& c, Stator v_V, Stator current_A, float bus_V, float dead_share) {
  const float over_bus = 1.0f / (bus_V > 1.0f ? bus_V : 1.0f);
  const float lost_V = dead_share * (bus_V + 2.0f * c.diode_drop_V),
              over_zone = 1.0f / (c.zone_A + c.ripple_A_V * (magnitude(v_V.a) + magnitude(v_V.b)));
  const Phases i = inverse_clarke(current_A);
  Phases lost{}, duty = inverse_clarke(v_V);
  for (std::size_t k = 0; k < 3; ++k) {
    lost[k] = lost_V * clamp(i[k] * over_zone, -1.0f, 1.0f);
    duty[k] = (duty[k] + lost[k]) * over_bus;
  }
  float high = duty[0] > duty[1] ? duty[0] : duty[1], low = duty[0] > duty[1] ? duty[1] : duty[0];
  high = duty[2] > high ? duty[2] : high;
  low = duty[2] < low ? duty[2] : low;
  // Centred, unless the highest phase would hide two samples: then as far down as the lowest phase allows.
  float shift = 0.5f - 0.5f * (high + low);
  if (high + shift > c.sample_duty) {
    const float down = high + shift - c.sample_duty, room = low + shift;
    shift -= down < room ? down : (room > 0.0f ? room : 0.0f);
  }
  Modulated m;
  Phases made{};
  for (std::size_t k = 0; k < 3; ++k) {
    const float counts = clamp((duty[k] + shift) * c.top + 0.5f, 0.0f, c.top);
    m.compare.phase[k] = static_cast<std::uint16_t>(counts);
    made[k] = static_cast<float>(m.compare.phase[k]) * c.over_top;
  }
  m.duty = clarke(made);
  m.lost_V = clarke(lost);
  return m;
}

// Three times what is in doubt, as too steep a compensation feeds on itself: 0.3 of the change that the bus makes through the winding in
// the dead time; and a node of some nanofarad. Tuned on the simulated drive, 2026-11-26; the ripple's share is half the ripple.
constexpr float kZoneOfDeadTime = 0.9f, kHighestBusOverLowest = 1.25f, kZone_counts = 4.0f, kRippleShare = 0.25f;

template <Board B>
constexpr ModulatorConfig configure_modulator(const Parameters& p) {
  const float pwm_s = 1.0f / static_cast<float>(B::kPwm_Hz), dead_s = 1e-9f * static_cast<float>(B::kDeadTime_ns);
  const float lowest_V = undervoltage_V(p) > 1.0f ? undervoltage_V(p) : 1.0f, top = static_cast<float>(B::kPwmTop);
  const float zone_A =
      kZoneOfDeadTime * kHighestBusOverLowest * lowest_V * dead_s / p.inductance_H + kZone_counts * magnitude(B::kCurrent_A_per_count);
  return {top, 1.0f / top, dead_s / pwm_s, B::kDiodeDrop_V, zone_A, kRippleShare * pwm_s / p.inductance_H, sample_duty<B>()};
}

}  // namespace rotorloop::firmware
