// Finds a rotor that turns by short pulses of the low sides, before any voltage is asked of the bridge. Between pulses no gate is driven
// and no current flows; in one the back-EMF alone drives a current through the winding, i = -e t / L, which the sample at its middle sees:
// its direction is that of the EMF, whatever L is. From sample to sample it turns with the rotor. A bridge that closes with no voltage
// instead, as a zero-current control does in its first two samples, lets an EMF of 9 V drive 65 A through 5.9 uH before it can answer.
#pragma once
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/angle.hpp"
#include "firmware/core/motor/start_up.hpp"
#include "firmware/core/motor/timing.hpp"
#include "firmware/core/motor/vector.hpp"

namespace rotorloop::firmware {

// Tuned on the simulated drive, 2026-11-28.
constexpr float kPulseWiden_s = 0.0012f;  // a pulse is widened, or narrowed, for this long at first
constexpr float kTurnFor_s = 0.0016f;     // then the turn from sample to sample is averaged …
constexpr float kTrackFor_s = 0.0035f;    // … and a phase-locked loop finds angle and speed
constexpr float kTrack_rad_s = 1200.0f;   // its natural frequency; damping 1
constexpr float kMostLowShare = 0.6f;     // of a PWM period: the rest of it empties the winding into the bus
constexpr float kEnough_counts = 40.0f;   // a current twenty times the noise
constexpr float kNothing_counts = 7.0f;   // below it nothing turns that could not be found with the windings shorted; 3.5 times the noise
constexpr float kMostOverEnough = 2.5f;
constexpr float kLeastTurnLock = 0.8f;                                  // mean cosine of turn against mean turn
constexpr float kLeastTrackLock = 0.93f, kTrackLockRate_1_s = 1000.0f;  // mean cosine of the loop's error
constexpr float kMissShare = 0.8f;                   // of what the first current says of the voltage that was missing: L is known to 30 %
constexpr float kLeastEmf = 0.35f, kMostEmf = 2.5f;  // of what the parameters say at that speed: L is known to 30 %, the zeros to 20 counts

struct FinderConfig {
  float period_s = 0.0f, over_period = 0.0f;
  float top = 1.0f;
  float least_low = 0.0f, most_low = kMostLowShare;  // of a PWM period
  float half_pwm_s = 0.0f, dead_s = 0.0f;
  float enough_A = 0.0f, nothing_A = 0.0f;
  float over_inductance = 0.0f, flux_linkage_Wb = 0.0f;
  float miss_V_A = 0.0f;  // voltage that a current made in one sample is taken for
  float loop_rad_s = kTrack_rad_s;
  float lock_rate = 0.0f;
  float load_e_1_rad = 0.0f;                              // deceleration by the propeller, per electrical speed²
  float forward_e_rad_s = 0.0f, backward_e_rad_s = 0.0f;  // slower rotors are left to the shorted windings
  std::uint16_t widen = 0, turn = 0, track = 0;           // samples
};

struct FinderState {
  std::uint16_t samples = 0;
  std::uint8_t closing = 0;    // found: samples until the current control has the bridge
  std::array<float, 3> low{};  // share: of the pulse measured now, of the next, of the one after it
  Stator before{};             // direction, length 1
  Stator turn{};               // sum of turns from sample to sample: cosine, sine
  float current_A = 0.0f;      // smoothed length
  Angle angle{};               // of the current, then of the rotor
  float omega_e_rad_s = 0.0f;
  float lock = 0.0f;
};

enum class Finding : std::uint8_t { looking, found, slow };

constexpr PwmCompare pulse(const FinderConfig& c, float low) {
  const std::uint16_t compare = static_cast<std::uint16_t>((1.0f - low) * c.top);
  return {{compare, compare, compare}};
}

// Wider while the current is too small to be measured, narrower when it is more than is needed.
constexpr float next_width(const FinderConfig& c, float low, float current_A) {
  const float factor = current_A < c.enough_A ? 1.12f : current_A > kMostOverEnough * c.enough_A ? 0.85f : 1.0f;
  return clamp(low * factor, c.least_low, c.most_low);
}

// Of a vector, by the arc sine from the nearest axis; within 1e-3 rad.
inline Angle direction_of(Stator v) {
  const bool along_a = magnitude(v.a) > magnitude(v.b);
  const float main = along_a ? v.a : v.b, across = along_a ? v.b : -v.a, size = length(v);
  const float x = size > 0.0f ? sign_of(main) * across / size : 0.0f, z = x * x;
  const float off_rad = x * (1.0f + z * (1.0f / 6 + z * (3.0f / 40 + z * (15.0f / 336 + z * (105.0f / 3456)))));
  return Angle{(along_a ? 0u : 0x4000'0000u) + (main < 0.0f ? 0x8000'0000u : 0u)} + Angle::from_rad(off_rad);
}

// One sample, taken in the middle of a pulse.
inline Finding step(const FinderConfig& c, FinderState& s, Stator current_A, float direction) {
  const float size = length(current_A);
  const float low = s.low[0];
  s.low[0] = s.low[1];
  s.low[1] = s.low[2];
  ++s.samples;
  s.current_A += 0.2f * (size - s.current_A);
  s.low[2] = s.samples <= c.widen || size > 2.0f * kMostOverEnough * c.enough_A ? next_width(c, s.low[2], size) : s.low[2];
  const Stator now = size > 0.0f ? (1.0f / size) * current_A : Stator{1.0f, 0.0f};
  const Stator turn{s.before.a * now.a + s.before.b * now.b, s.before.a * now.b - s.before.b * now.a};
  s.before = now;
  if (s.samples <= c.widen) return Finding::looking;
  if (s.current_A < c.nothing_A) return Finding::slow;
  if (s.samples <= c.widen + c.turn) {
    s.turn = s.turn + turn;
    if (s.samples < c.widen + c.turn) return Finding::looking;
    if (length(s.turn) < kLeastTurnLock * static_cast<float>(c.turn)) return Finding::slow;
    s.omega_e_rad_s = direction_of(s.turn).rad() * c.over_period;
    s.angle = direction_of(now);
    s.lock = 0.5f;
    return Finding::looking;
  }
  s.omega_e_rad_s -= c.period_s * c.load_e_1_rad * s.omega_e_rad_s * magnitude(s.omega_e_rad_s);
  s.angle = s.angle + Angle::from_rad(s.omega_e_rad_s * c.period_s);
  const Rotation at = rotation(s.angle);
  const float cosine = at.cos * now.a + at.sin * now.b, sine = at.cos * now.b - at.sin * now.a;
  const float error = cosine > 0.0f ? sine : sign_of(sine);
  s.angle = s.angle + Angle::from_rad(2.0f * c.loop_rad_s * c.period_s * error);
  s.omega_e_rad_s += c.period_s * c.loop_rad_s * c.loop_rad_s * error;
  s.lock += c.lock_rate * (cosine - s.lock);
  if (s.samples < c.widen + c.turn + c.track) return Finding::looking;
  // The EMF meant is that of the middle of the pulse's first half; the magnet stands a right angle ahead of the current it drives, seen in
  // the direction of rotation.
  const float since_s = low * c.half_pwm_s - c.dead_s, speed = magnitude(s.omega_e_rad_s);
  s.angle = s.angle + Angle::from_rad(s.omega_e_rad_s * 0.5f * since_s) + Angle{s.omega_e_rad_s > 0.0f ? 0x4000'0000u : 0xC000'0000u};
  const float expected_A = speed * c.flux_linkage_Wb * since_s * c.over_inductance;
  const bool credible = s.lock > kLeastTrackLock && s.current_A > kLeastEmf * expected_A && s.current_A < kMostEmf * expected_A;
  return credible && speed > (s.omega_e_rad_s * direction > 0.0f ? c.forward_e_rad_s : c.backward_e_rad_s) ? Finding::found : Finding::slow;
}

template <Board B>
constexpr FinderConfig configure_finder(const Parameters& p, const StartConfig& start, float load_e_1_rad, float period_s) {
  const float pwm_s = 1.0f / static_cast<float>(B::kPwm_Hz), A_per_count = magnitude(B::kCurrent_A_per_count);
  const float pole_pairs = static_cast<float>(p.pole_pairs);
  FinderConfig c;
  c.period_s = period_s;
  c.over_period = 1.0f / period_s;
  c.top = static_cast<float>(B::kPwmTop);
  c.least_low = 1.0f - sample_duty<B>();
  c.half_pwm_s = 0.5f * pwm_s;
  c.dead_s = 1e-9f * static_cast<float>(B::kDeadTime_ns);
  c.enough_A = kEnough_counts * A_per_count;
  c.nothing_A = kNothing_counts * A_per_count;
  c.over_inductance = 1.0f / p.inductance_H;
  c.flux_linkage_Wb = p.flux_linkage_Wb;
  c.miss_V_A = kMissShare * p.inductance_H / period_s;
  c.lock_rate = kTrackLockRate_1_s * period_s;
  c.load_e_1_rad = load_e_1_rad;
  c.forward_e_rad_s = pole_pairs * start.catch_speed_rad_s;
  c.backward_e_rad_s = pole_pairs * start.backward_speed_rad_s;
  c.widen = ticks(kPulseWiden_s, period_s);
  c.turn = ticks(kTurnFor_s, period_s);
  c.track = ticks(kTrackFor_s, period_s);
  return c;
}

}  // namespace rotorloop::firmware
