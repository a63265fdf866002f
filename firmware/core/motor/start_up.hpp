// From standstill to a locked observer: look for a rotor that already turns (catch), pull the rotor to a known angle by a
// sweep and a hold (a hold alone can meet the dead point opposite), turn a current vector up to the speed at which the back-EMF is trusted,
// hand over. A pure function of time ticks; the motor applies what it says.
#pragma once
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/angle.hpp"
#include "firmware/core/motor/motor_scale.hpp"

namespace rotorloop::firmware {

// Shares of the motor's own quantities (motor_scale.hpp), tuned on the simulated drive, 2026-11-23 where no other date stands
// (docs/decisions/0012 has the reasons). The swing: of a rotor held by the start current, in rad/s.
constexpr float kGiveUp = 1.67f;  // of the hand-over's speed: no lock until here is a failed start
constexpr float kCatch = 1.6f;    // of it: slower rotors are started afresh, as the dead time hides them
// Of it, against the direction asked for: slower rotors brake themselves through shorted windings, which needs no estimate; 2026-11-26.
constexpr float kBackward = 4.0f;
constexpr float kShortCatch = 1.1f;  // of it: with the windings shorted no leg switches, so no dead time hides what the rotor induces
constexpr float kLead_s = 0.004f;    // how long a rotor nearly at rest turns until the current holds it; 2026-11-26
constexpr float kRestEmf = 0.1f;     // of the back-EMF of the hand-over: less, and the rotor may be taken for being at rest; 2026-11-26
constexpr float kCatchRate_1_s = 400.0f;  // a mean of 2.5 ms
// The swing dies within about two and a half of its periods.
constexpr float kAlignFirst_rad = 9.0f, kAlignSecond_rad = 14.3f;  // of the swing
constexpr float kAlignRise = 0.4f, kMeasureWindow = 0.19f;  // of the first step: current ramp; of the second: when the swing has died
// A share of the acceleration that the current can give, and at least four electrical turns on the way to the hand-over.
constexpr float kRampTorque = 0.2f, kRampTurns_1_rad = 1.0f / 50.0f;
// A quarter of critical damping: at a tenth a rotor that began far off still swings past the opposite dead point when the current falls;
// 2026-11-26.
constexpr float kDamping = 0.5f, kMostDamping = 0.67f,
                kDampingCorner = 0.168f;  // twice the damping ratio; of the start current; of the swing
// Faster than the swing, and the damping current's own inductive voltage would feed the damper.
constexpr float kAcrossCorner = 2.23f;  // of the swing
constexpr float kHandOver_rad = 1.8f;   // of the swing, in which the d current fades out
// Of the shorted motor's time constants at most: a rotor that is still fast meets no alignment; 2026-11-26.
constexpr float kShortBrake = 4.0f;
constexpr float kRestCurrent = 0.1f, kRest_counts = 20.0f;  // of the start current; of the sensors' zeros

struct StartConfig {
  float tick_s = 0.0f;
  float current_A = 0.0f;
  float catch_speed_rad_s = 0.0f, backward_speed_rad_s = 0.0f;  // mechanical
  float lead_e_s = 0.0f;                                        // pole pairs times the time
  float swing_V = 0.0f;                                         // of back-EMF
  std::uint32_t align_rounds = 2;
  float catch_filter = 0.0f, catch_steady = 0.5f, catch_steady_s = 0.007f;  // within half of the mean for 7 ms
  float align_first_s = 0.0f, align_second_s = 0.0f;
  float align_from_rad = 2.1f, align_to_rad = 0.5f;  // of the sweep in the first step, electrical
  float align_rise_s = 0.0f;
  // The second step measures the resistance from two currents (dead time and diodes drop out of the difference): at low speed
  // a wrong one is the observer's worst enemy, and it changes by 0.4 % per kelvin.
  float measure_low_share = 0.55f;   // of current_A, second half
  float measure_window_s = 0.0f;     // at the end of each half
  float acceleration_rad_s2 = 0.0f;  // mechanical, of the turned vector
  // A rotor held by a current vector swings like a pendulum with hardly any friction. Its swing shows in the voltage across the
  // vector, where no resistance error hides it; a current across the vector answers it.
  float damping_A_V = 0.0f, damping_most_A = 0.0f;
  // Of the current along the vector, while it stands at phase U: all three phases keep their signs (-1/2 + 0.45·√3/2 < 0), so a dead time
  // not yet known does not feed the damper, and while the resistance is measured they keep off zero, where the loss is not constant.
  float damping_align_share = 0.45f, damping_measure_share = 0.25f;
  float damping_corner_rad_s = 0.0f;                   // what changes more slowly is the vector's own turning
  float hand_over_rad_s = 0.0f, give_up_rad_s = 0.0f;  // mechanical
  float lock = 0.93f;                                  // mean cosine of the phase-locked loop's error
  float hand_over_s = 0.0f;
  float short_brake_s = 0.0f;
  float rest_A = 0.0f, rest_s = 0.003f;  // a rotor that induces less may be taken for being at rest
  float short_catch_speed_rad_s = 0.0f;  // mechanical, in the direction asked for
};

// Of the voltage across the current vector, per sample.
constexpr float across_filter(const MotorScale& m, float period_s) { return clamp(kAcrossCorner * m.swing_rad_s * period_s, 1e-3f, 0.2f); }

template <Board B>
constexpr void configure_start(const Parameters& p, const MotorScale& m, float resistance_ohm, float tick_s, StartConfig& s) {
  const float pole_pairs = static_cast<float>(p.pole_pairs), hand_over_e = m.hand_over_e_rad_s, over_swing_s = 1.0f / m.swing_rad_s;
  s.tick_s = tick_s;
  s.current_A = m.start_A;
  s.hand_over_rad_s = hand_over_e * (1.0f / pole_pairs);
  s.give_up_rad_s = kGiveUp * s.hand_over_rad_s;
  s.catch_speed_rad_s = kCatch * s.hand_over_rad_s;
  s.backward_speed_rad_s = kBackward * s.hand_over_rad_s;
  s.short_catch_speed_rad_s = kShortCatch * s.hand_over_rad_s;
  s.lead_e_s = kLead_s * pole_pairs;
  s.swing_V = kRestEmf * hand_over_e * p.flux_linkage_Wb;
  s.catch_filter = clamp(kCatchRate_1_s * s.tick_s, 0.02f, 0.5f);
  s.align_first_s = clamp(kAlignFirst_rad * over_swing_s, 0.05f, 0.3f);
  s.align_second_s = clamp(kAlignSecond_rad * over_swing_s, 0.08f, 0.5f);
  s.align_rise_s = kAlignRise * s.align_first_s;
  s.measure_window_s = kMeasureWindow * s.align_second_s;
  const float most_rad_s2 = kRampTorque * m.torque_constant_N_m_A * m.start_A / p.inertia_kg_m2;
  const float turns_rad_s2 = s.hand_over_rad_s * s.hand_over_rad_s * pole_pairs * kRampTurns_1_rad;
  s.acceleration_rad_s2 = most_rad_s2 < turns_rad_s2 ? most_rad_s2 : turns_rad_s2;
  s.damping_A_V = kDamping * p.inertia_kg_m2 * m.swing_rad_s / (m.torque_constant_N_m_A * p.flux_linkage_Wb * pole_pairs);
  s.damping_most_A = kMostDamping * m.start_A;
  s.damping_corner_rad_s = kDampingCorner * m.swing_rad_s;
  s.hand_over_s = clamp(kHandOver_rad * over_swing_s, 0.005f, 0.05f);
  const float shorted_s = p.inertia_kg_m2 * resistance_ohm / (m.torque_constant_N_m_A * p.flux_linkage_Wb * pole_pairs);
  s.short_brake_s = clamp(kShortBrake * shorted_s, 0.02f, 1.0f);
  const float offset_A = kRest_counts * magnitude(B::kCurrent_A_per_count);
  s.rest_A = kRestCurrent * m.start_A > 2.0f * offset_A ? kRestCurrent * m.start_A : 2.0f * offset_A;
}

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
  bool pulsed = false;   // first part of the catching (rotor_finder.hpp)
  bool shorted = false;  // second part of it
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

// What turns too slowly for pulses (rotor_finder.hpp), or was not seen at all: the windings are shorted, which shows it and brakes it.
// True: not yet done.
constexpr bool brake_and_look(const StartConfig& c, StartState& s, const StartInputs& in, StartStep& out) {
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
  if (low && measuring(c, s)) {
    s.low_V += in.along_V;
    s.low_A += in.along_A;
    s.low_lost += in.lost_along;
    s.low_count += 1.0f;
  }
  if (!low && !first && measuring(c, s)) {
    s.high_V += in.along_V;
    s.high_A += in.along_A;
    s.high_lost += in.lost_along;
    s.high_count += 1.0f;
  }
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
    if (brake_and_look(c, s, in, out)) return out;
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
