// From standstill to a locked observer: look for a rotor that already turns (catch), pull the rotor to a known angle by a
// sweep and a hold (a hold alone can meet the dead point opposite), turn a current vector up to the speed at which the back-EMF is trusted,
// hand over. A pure function of time ticks; the motor applies what it says.
#pragma once
#include <cstdint>

#include "firmware/core/interface.hpp"
#include "firmware/core/motor/angle.hpp"

namespace rotorloop::firmware {

// The values are those of the reference motor; configure_start() (config.hpp) scales them to any other.
struct StartConfig {
  float tick_s = 250e-6f;
  float current_A = 12.0f;
  float catch_s = 0.015f;
  float catch_speed_rad_s = 200.0f;  // mechanical, 0.5 V of back-EMF: slower rotors are started afresh, as the dead time hides them
  // Against the direction asked for: slower rotors brake themselves through shorted windings, which needs no estimate.
  float backward_speed_rad_s = 504.0f;
  float lead_e_s = 0.028f;  // pole pairs and 4 ms: how far a rotor nearly at rest turns until the current holds it
  float swing_V = 0.03f;    // of back-EMF that is left when the rotor may be taken for being at rest: a tenth of the hand-over's
  std::uint32_t align_rounds = 2;
  float catch_filter = 0.1f, catch_steady = 0.5f, catch_steady_s = 0.007f;  // within half of the mean of 2.5 ms for 7 ms
  float align_first_s = 0.050f, align_second_s = 0.080f;
  float align_from_rad = 2.1f, align_to_rad = 0.5f;  // of the sweep in the first step, electrical
  float align_rise_s = 0.020f;                       // current ramp
  // The second step measures the resistance from two currents (dead time and diodes drop out of the difference): at low speed
  // a wrong one is the observer's worst enemy, and it changes by 0.4 % per kelvin.
  float measure_low_share = 0.55f;     // of current_A, second half
  float measure_window_s = 0.015f;     // at the end of each half, when the swing has died
  float acceleration_rad_s2 = 800.0f;  // mechanical, of the turned vector: about 60 % of what 12 A can give at full load angle
  // A rotor held by a current vector swings like a pendulum with hardly any friction. Its swing shows in the voltage across the
  // vector, where no resistance error hides it; a current across the vector answers it.
  float damping_A_V = 98.0f;  // 0.23 A per rad/s at 3.4e-4 Wb and 7 pole pairs
  float damping_most_A = 8.0f;
  // Of the current along the vector, while it stands at phase U: all three phases keep their signs (-1/2 + 0.45·√3/2 < 0), so a dead time
  // not yet known does not feed the damper, and while the resistance is measured they keep off zero, where the loss is not constant.
  float damping_align_share = 0.45f, damping_measure_share = 0.25f;
  float damping_corner_rad_s = 30.0f;  // what changes more slowly is the vector's own turning
  float hand_over_rad_s = 126.0f;      // mechanical, 1 200 RPM: back-EMF 0.3 V against 0.1 V of doubt (20 % of R at 12 A)
  float give_up_rad_s = 210.0f;        // mechanical: no lock until here is a failed start
  float lock = 0.93f;                  // mean cosine of the phase-locked loop's error
  float hand_over_s = 0.010f;          // d current fades out
  float short_brake_s = 0.150f;        // at most: two to three times the shorted motor's time constant
  // With the windings shorted no leg switches, so no dead time hides what the rotor induces.
  float rest_A = 1.2f, rest_s = 0.003f;    // a rotor that induces less may be taken for being at rest
  float short_catch_speed_rad_s = 140.0f;  // mechanical, in the direction asked for
};

struct StartState {
  MotorState phase = MotorState::off;
  float in_phase_s = 0.0f;
  float speed_rad_s = 0.0f;  // of the turned vector, mechanical, signed
  float direction = 1.0f;
  float across_slow_V = 0.0f;                                      // slow part of the voltage across the vector
  float low_V = 0.0f, low_A = 0.0f, high_V = 0.0f, high_A = 0.0f;  // sums of the resistance measurement …
  float low_lost = 0.0f, high_lost = 0.0f;
  float low_count = 0.0f, high_count = 0.0f;  // … and of how many ticks
  float steady_s = 0.0f;                      // while catching
  float swing_V = 0.0f;
  std::uint32_t rounds = 0;
  bool shorted = false;  // second part of the catching
  float induced_A = 0.0f, rest_s = 0.0f;
  Angle axis{};        // that the rotor is held at …
  bool found = false;  // … because it was seen there
};

struct StartInputs {
  float along_V = 0.0f, along_A = 0.0f;  // voltage and current along the current vector
  float lost_along = 4.0f / 3.0f;        // voltage lost along it per voltage lost by a phase
  float across_V = 0.0f;                 // voltage across the current vector, resistive part taken off
  float observed_rad_s = 0.0f;
  Angle observed{};
  float lock = 0.0f;
  float flux_ratio = 0.0f;
  float current_A = 0.0f;  // length of the current vector
};

struct StartStep {
  float current_A = 0.0f;  // along the frame's d axis
  float damping_A = 0.0f;  // across it
  Angle frame{};           // valid when set_frame
  bool set_frame = false;
  float resistance_ohm = 0.0f;  // > 0 once, at the end of the alignment: phase and switch …
  float lost_V = 0.0f;          // … and the voltage that a phase loses beyond what is assumed: the dead time's error
  bool own_frame = false;       // current control in the turned frame, not the observer's
  bool hand_over = false;       // observer may take the frame now
  bool caught = false;          // rotor was turning: run at once
  bool shorted = false;         // all low sides on
  bool failed = false;
};

constexpr bool trustworthy(const StartConfig& c, const StartInputs& in) {
  return in.lock > c.lock && in.flux_ratio > 0.5f && in.flux_ratio < 1.6f;
}

// At the end of each half of the second step.
constexpr bool measuring(const StartConfig& c, const StartState& s) {
  const float second_s = s.in_phase_s - c.align_first_s, half_s = 0.5f * c.align_second_s;
  return second_s > c.align_second_s - c.measure_window_s || (second_s < half_s && second_s > half_s - c.measure_window_s);
}

// Two currents, two voltages: V = R i + lost · lost_along.
constexpr void solve_alignment(const StartConfig& c, const StartState& s, StartStep& out) {
  if (!(s.low_count > 0.0f && s.high_count > 0.0f)) return;
  const float over_low = 1.0f / s.low_count, over_high = 1.0f / s.high_count;
  const float low_A = s.low_A * over_low, high_A = s.high_A * over_high, low_lost = s.low_lost * over_low,
              high_lost = s.high_lost * over_high;
  const float low_V = s.low_V * over_low, high_V = s.high_V * over_high;
  const float determinant = high_A * low_lost - low_A * high_lost;
  if (high_A - low_A < 0.1f * c.current_A || magnitude(determinant) < 0.1f * c.current_A) return;
  out.resistance_ohm = (high_V * low_lost - low_V * high_lost) / determinant;
  out.lost_V = (high_A * low_V - low_A * high_V) / determinant;
}

// Still looking for a rotation? A rotor that turns keeps its speed; what the dead time makes of noise on one that stands does not.
constexpr bool look_for_rotation(const StartConfig& c, StartState& s, const StartInputs& in, StartStep& out) {
  s.speed_rad_s += c.catch_filter * (in.observed_rad_s - s.speed_rad_s);
  const bool steady = magnitude(in.observed_rad_s - s.speed_rad_s) < c.catch_steady * magnitude(s.speed_rad_s);
  const bool turns = trustworthy(c, in) && steady &&
                     magnitude(s.speed_rad_s) > (s.speed_rad_s * s.direction > 0.0f ? c.catch_speed_rad_s : c.backward_speed_rad_s);
  s.steady_s = turns ? s.steady_s + c.tick_s : 0.0f;
  if (s.in_phase_s < c.catch_s) return true;
  out.caught = s.steady_s >= c.catch_steady_s;
  // Perhaps it turns, but not yet for long enough.
  const bool perhaps = in.lock > c.lock && magnitude(in.observed_rad_s) > c.catch_speed_rad_s;
  return out.caught || (perhaps && s.in_phase_s < 2.0f * c.catch_s);
}

// What turns too slowly for that, or was not seen at all: the windings are shorted, which shows it and brakes it. True: not yet done.
constexpr bool brake_and_look(const StartConfig& c, StartState& s, const StartInputs& in, StartStep& out) {
  out.shorted = true;
  s.speed_rad_s += c.catch_filter * (in.observed_rad_s - s.speed_rad_s);
  s.induced_A += c.catch_filter * (in.current_A - s.induced_A);
  const bool steady = magnitude(in.observed_rad_s - s.speed_rad_s) < 0.5f * c.catch_steady * magnitude(s.speed_rad_s);
  const bool turns = trustworthy(c, in) && steady && s.induced_A > c.rest_A && s.speed_rad_s * s.direction > c.short_catch_speed_rad_s;
  s.steady_s = turns ? s.steady_s + c.tick_s : 0.0f;
  out.caught = s.steady_s >= c.catch_steady_s;
  const bool rests = s.in_phase_s > c.rest_s && s.induced_A < c.rest_A;
  s.rest_s = rests ? s.rest_s + c.tick_s : 0.0f;
  return out.caught || (s.rest_s < c.rest_s && s.in_phase_s < c.short_brake_s);
}

// Of the six directions in which a phase carries the whole current.
constexpr Angle nearest_axis(Angle a) {
  const std::uint32_t k = static_cast<std::uint32_t>((std::uint64_t{a.raw} * 6u + 0x8000'0000u) >> 32);
  return {k * 715'827'883u};
}

// A rotor whose last turning was seen needs no sweep, nor a second hold: it is held where it is.
constexpr void begin_align(const StartConfig& c, StartState& s, const StartInputs& in) {
  const bool found = trustworthy(c, in) && s.induced_A > 0.5f * c.rest_A;
  s = {MotorState::align, found ? c.align_first_s : 0.0f, 0.0f, s.direction, 0.0f};
  s.found = found;
  if (found) s.axis = nearest_axis(in.observed + Angle::from_rad(in.observed_rad_s * c.lead_e_s));
}

// The larger current first: with a smaller one a swing that is still wide would pass the dead point opposite, or end on it.
constexpr void align(const StartConfig& c, StartState& s, const StartInputs& in, StartStep& out) {
  const float second_s = s.in_phase_s - c.align_first_s;
  const bool first = second_s < 0.0f, low = !first && second_s > 0.5f * c.align_second_s;
  out.own_frame = out.set_frame = true;
  // A vector that moves leaves the dead point opposite to it behind; one that stands still can hold a rotor there by friction.
  const float swept = clamp(s.in_phase_s / c.align_first_s, 0.0f, 1.0f);
  out.frame = s.axis + Angle::from_rad(first ? c.align_from_rad + swept * (c.align_to_rad - c.align_from_rad) : 0.0f);
  out.current_A = c.current_A * clamp(s.in_phase_s / c.align_rise_s, 0.0f, 1.0f) * (low ? c.measure_low_share : 1.0f);
  if (low && measuring(c, s)) s.low_V += in.along_V, s.low_A += in.along_A, s.low_lost += in.lost_along, s.low_count += 1.0f;
  if (!low && !first && measuring(c, s)) s.high_V += in.along_V, s.high_A += in.along_A, s.high_lost += in.lost_along, s.high_count += 1.0f;
  // Across the vector only what still swings induces a voltage; a rotor that turned before needs another round to come to rest.
  s.swing_V += c.catch_filter * (magnitude(in.across_V - s.across_slow_V) - s.swing_V);
  if (second_s < c.align_second_s) return;
  if (s.swing_V > c.swing_V && s.rounds < c.align_rounds && !s.found) {
    ++s.rounds;
    s.in_phase_s = c.align_first_s;
    s.low_V = s.low_A = s.low_lost = s.low_count = s.high_V = s.high_A = s.high_lost = s.high_count = 0.0f;
    return;
  }
  solve_alignment(c, s, out);
  s = {MotorState::ramp, 0.0f, 0.0f, s.direction, s.across_slow_V};
}

constexpr void ramp(const StartConfig& c, StartState& s, const StartInputs& in, StartStep& out) {
  s.speed_rad_s += s.direction * c.acceleration_rad_s2 * c.tick_s;
  out.own_frame = true;
  out.current_A = c.current_A;
  const bool agrees = magnitude(in.observed_rad_s - s.speed_rad_s) < 0.25f * magnitude(s.speed_rad_s);
  if (magnitude(s.speed_rad_s) >= c.hand_over_rad_s && trustworthy(c, in) && agrees)
    out.hand_over = true;
  else
    out.failed = magnitude(s.speed_rad_s) >= c.give_up_rad_s;
}

constexpr StartStep step(const StartConfig& c, StartState& s, const StartInputs& in) {
  StartStep out;
  s.in_phase_s += c.tick_s;
  s.across_slow_V += c.damping_corner_rad_s * c.tick_s * (in.across_V - s.across_slow_V);
  if (s.phase == MotorState::catching) {
    if (s.shorted ? brake_and_look(c, s, in, out) : look_for_rotation(c, s, in, out)) return out;
    if (!s.shorted) {
      s = {MotorState::catching, 0.0f, 0.0f, s.direction};
      out.shorted = s.shorted = true;
      return out;
    }
    begin_align(c, s, in);
  } else {
    const float align_A = (measuring(c, s) ? c.damping_measure_share : c.damping_align_share) * in.along_A;
    const float asked_A = s.phase == MotorState::align ? align_A : c.damping_most_A, most_A = asked_A > 0.0f ? asked_A : 0.0f;
    out.damping_A = clamp(c.damping_A_V * (s.across_slow_V - in.across_V), -most_A, most_A);
  }
  if (s.phase == MotorState::align)
    align(c, s, in, out);
  else if (s.phase == MotorState::ramp)
    ramp(c, s, in, out);
  return out;
}

}  // namespace rotorloop::firmware
