// Parameters (what a user sets) and the board's constants, turned once into what every block of the motor control needs: whatever the
// interrupt would divide by is divided here, every number of samples is made of seconds, and every rate scales with the motor
// (motor_scale.hpp).
#pragma once
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/current_loop.hpp"
#include "firmware/core/motor/current_sense.hpp"
#include "firmware/core/motor/dead_time.hpp"
#include "firmware/core/motor/health.hpp"
#include "firmware/core/motor/limits.hpp"
#include "firmware/core/motor/modulator.hpp"
#include "firmware/core/motor/motor_scale.hpp"
#include "firmware/core/motor/observer.hpp"
#include "firmware/core/motor/protection.hpp"
#include "firmware/core/motor/resistance.hpp"
#include "firmware/core/motor/sample_check.hpp"
#include "firmware/core/motor/self_test.hpp"
#include "firmware/core/motor/speed_loop.hpp"
#include "firmware/core/motor/start_up.hpp"

namespace rotorloop::firmware {

// The RPM loop and all supervision run once every kSlots samples, each job in its own sample so that no interrupt is long.
constexpr std::uint32_t kSlots = 6;

// The main loop writes a set-point with every poll; after this long without one that is finite the motor coasts (two missed polls).
constexpr float kOrderLife_s = 0.020f;

// Of a current amplifier's zero within the seconds of a start.
constexpr float kDrift_counts = 5.0f;
// Of outrunners when it is not known: 1.0 to 1.4.
constexpr float kInductanceRatio = 1.0f;
// The torque current is led from one limit to the other within this time: faster, and the part of the inductance that the parameters
// have wrong would turn the observer by as much as it turns in a whole period of the phase-locked loop.
constexpr float kCurrentSwing_s = 0.002f;

struct StopConfig {
  StopMode mode = StopMode::coast;
  float current_A = 0.0f;
  float tone_A = 0.0f;
};

// A current along the estimated magnet at low speed. It makes no torque, but keeps the phases away from the currents at which what the
// dead time takes is not known, which at these speeds is more than the back-EMF; and a rotor that the estimate leaves is pulled back.
struct HoldConfig {
  float current_A = 0.0f;
  float full_rad_s = 0.0f, none_rad_s = 1.0f;  // mechanical: all of it below, nothing above
  float over_fade_s = 1.0f;                    // 1 over the difference of both
  float most_step_A = 0.0f;                    // per supervision tick
};
constexpr float hold_current_A(const HoldConfig& c, float speed_rad_s) {
  return c.current_A * clamp((c.none_rad_s - magnitude(speed_rad_s)) * c.over_fade_s, 0.0f, 1.0f);
}

struct MotorConfig {
  ParameterProblem problem = ParameterProblem::none;
  float period_s = 0.0f;  // of the current loop
  float pole_pairs = 7.0f, over_pole_pairs = 1.0f / 7.0f;
  SenseConfig sense{};
  SampleCheckConfig check{};
  ModulatorConfig modulator{};
  DeadTimeConfig dead_time{};
  CurrentLoopConfig current{};
  ObserverConfig observer{};
  LimitConfig limits{};
  SpeedLoopConfig speed{};
  StartConfig start{};
  ProtectionConfig protection{};
  ResistanceConfig resistance{};
  HealthConfig health{};
  StopConfig stop{};
  HoldConfig hold{};
  bool compensate_delay = true;  // false only to show what it prevents
  // Of the torque current while an estimate is young: during the hand-over, and until the resistance has been measured at rest.
  float hand_over_share = 0.5f, unmeasured_share = 0.7f;
  float rad_s2_A = 0.0f;      // electrical acceleration per torque current …
  float load_e_1_rad = 0.0f;  // … and lost to the propeller, per electrical speed²
  float over_resistance = 0.0f;
  float weaken_A_per_V = 0.6f;  // field weakening integral, per supervision tick
  float weaken_most_A = 0.0f;
  float across_filter = 0.0f;   // voltage along and across the start vector
  float bus_filter = 0.25f;     // 0.16 ms
  float bus_jump_V = 1.0f;      // of the bus between two samples that is accepted at once
  float weaken_margin = 0.95f;  // of the voltage limit at which it begins
  float most_step_A = 0.0f;     // of the torque current, per supervision tick
  std::uint32_t order_ticks = 0;
  std::uint32_t late_us = 0;  // between two rounds of slots: one sample or more has been missed
};

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

template <Board B>
constexpr float sample_s() {
  return static_cast<float>(B::kPwmPeriodsPerSample) / static_cast<float>(B::kPwm_Hz);
}

// Highest electrical speed that this board's sampling can hold: seven samples per turn, f_s · 60/7 electrical RPM.
template <Board B>
constexpr float usable_speed_e_rad_s() {
  return 2.0f * kPi / (7.0f * sample_s<B>());
}

// Why this board cannot serve these parameters.
template <Board B>
constexpr ParameterProblem problem_of(const Parameters& p) {
  const bool positive =
      p.pole_pairs > 0 && p.resistance_ohm > 0.0f && p.inductance_H > 0.0f && p.flux_linkage_Wb > 0.0f && p.inertia_kg_m2 > 0.0f;
  if (!positive) return ParameterProblem::motor_not_positive;
  if (p.max_speed_rad_s * static_cast<float>(p.pole_pairs) > 1.0001f * usable_speed_e_rad_s<B>())
    return ParameterProblem::speed_beyond_sampling;
  const float above = 4095.0f - B::kCurrentZero_counts, least = above < B::kCurrentZero_counts ? above : B::kCurrentZero_counts;
  if (!(p.phase_current_limit_A <= least * magnitude(B::kCurrent_A_per_count))) return ParameterProblem::current_beyond_sensor;
  if (!(p.overvoltage_V <= 4095.0f * B::kBus_V_per_count)) return ParameterProblem::voltage_beyond_divider;
  // Less than 2 % of the limit at the lowest bus: the motor is not the one of the parameters.
  if (!(undervoltage_V(p) > 0.02f * p.phase_current_limit_A * kRoot3 * p.resistance_ohm)) return ParameterProblem::resistance_beyond_supply;
  return ParameterProblem::none;
}

template <Board B>
constexpr void configure_sensing(const Parameters& p, MotorConfig& c) {
  const float pwm_s = 1.0f / static_cast<float>(B::kPwm_Hz), dead_s = 1e-9f * static_cast<float>(B::kDeadTime_ns);
  const float A_per_count = magnitude(B::kCurrent_A_per_count), lowest_V = undervoltage_V(p) > 1.0f ? undervoltage_V(p) : 1.0f;
  // Half of the low side's time lies before the sample.
  const float sample_duty = 1.0f - (2e-9f * static_cast<float>(B::kSampleWindow_ns) + dead_s) / pwm_s;
  c.sense = {B::kCurrent_A_per_count,
             B::kCurrentZero_counts,
             B::kCurrentZeroTolerance_counts,
             static_cast<std::uint16_t>(sample_duty * static_cast<float>(B::kPwmTop)),
             static_cast<std::uint16_t>((1.0f - sample_duty) * static_cast<float>(B::kPwmTop)),  // the same time, seen from the other end
             40.0f * static_cast<float>(kSlots) * c.period_s,
             ticks(0.005f, c.period_s)};
  c.check.sum_A = 136.0f * A_per_count;
  c.check.change_A_V = 1.5f * c.period_s / p.inductance_H;
  // Three times what is in doubt, as too steep a compensation feeds on itself: 0.3 of the change that the bus makes through the winding in
  // the dead time; and a node of some nanofarad.
  const float zone_A = 0.9f * 1.25f * lowest_V * dead_s / p.inductance_H + 4.0f * A_per_count;
  const float top = static_cast<float>(B::kPwmTop);
  c.modulator = {top, 1.0f / top, dead_s / pwm_s, B::kDiodeDrop_V, zone_A, 0.25f * pwm_s / p.inductance_H, sample_duty};
  // A driver's own delays add to the timer's dead time, charge of the switches takes from it: 0.4 to 1.6 of what the board says.
  c.dead_time.least_share = 0.4f * c.modulator.dead_share;
  c.dead_time.most_share = 1.6f * c.modulator.dead_share;
  c.dead_time.align_share = 0.55f * c.modulator.dead_share;
  c.dead_time.unknown_share = 0.8f * c.modulator.dead_share;
}

inline void configure_observer(const Parameters& p, const MotorScale& m, float resistance_ohm, MotorConfig& c) {
  ObserverConfig& o = c.observer;
  o.period_s = c.period_s;
  o.over_period = 1.0f / c.period_s;
  o.resistance_ohm = resistance_ohm;
  // With the inductance across the magnet what is left of the flux points along the magnet, whatever the one along it. A little less than
  // the one at small currents: iron saturates. Of 900 drawn 5-inch motors 883 fly without a trip, 872 with all of it.
  const float ratio = p.inductance_ratio > 0.0f ? p.inductance_ratio : kInductanceRatio;
  o.inductance_H = 0.96f * p.inductance_H * 2.0f * ratio / (1.0f + ratio);
  o.flux_linkage_Wb = p.flux_linkage_Wb;
  o.over_flux = 1.0f / p.flux_linkage_Wb;
  o.pull_min_rad_s = 0.28f * m.hand_over_e_rad_s < 1000.0f ? 0.28f * m.hand_over_e_rad_s : 1000.0f;
  o.offset_most_V = p.flux_linkage_Wb * m.hand_over_e_rad_s;
  o.search_rate = o.lock_rate = 480.0f * c.period_s;
  o.max_omega_e_rad_s = 1.08f / c.period_s;
  o.speed_corner_rad_s = c.speed.feedback_rad_s * 0.75f;
  const float full_A = p.phase_current_limit_A, w = p.max_speed_rad_s;
  o.unknown_most_rad_s2 = c.pole_pairs / p.inertia_kg_m2 * (m.torque_constant_N_m_A * full_A + p.load_N_m_s2 * w * w);
}

inline void configure_speed_loop(const Parameters& p, const MotorScale& m, MotorConfig& c) {
  SpeedLoopConfig& s = c.speed;
  s.period_s = c.period_s * static_cast<float>(kSlots);
  s.torque_constant_N_m_A = m.torque_constant_N_m_A;
  s.inertia_kg_m2 = p.inertia_kg_m2;
  s.load_N_m_s2 = p.load_N_m_s2;
  s.inertia_A_s2 = p.inertia_kg_m2 / m.torque_constant_N_m_A;
  s.load_A_s2 = p.load_N_m_s2 / m.torque_constant_N_m_A;
  // 400 rad/s at 247 rad/s, the reference motor; a thirtieth of the sampling's 24 kHz at most, which a 3-inch motor reaches.
  s.feedback_rad_s = clamp(1.62f * m.electromechanical_rad_s, 100.0f, clamp(0.0333f / c.period_s, 200.0f, 1000.0f));
  s.reference_rad_s = 1.25f * s.feedback_rad_s;
  s.over_full_speed_s = c.pole_pairs / (12.25f * s.feedback_rad_s);
  s.slew_rad_s2 = p.speed_slew_rad_s2;
  s.max_speed_rad_s = p.max_speed_rad_s;
  s.min_speed_rad_s = p.min_speed_rad_s;
  s.over_fade_s = 1.0f / (0.02f * p.max_speed_rad_s);
}

inline void configure_start(const Parameters& p, const MotorScale& m, float resistance_ohm, float offset_A, MotorConfig& c) {
  StartConfig& s = c.start;
  const float hand_over_e = m.hand_over_e_rad_s, over_swing_s = 1.0f / m.swing_rad_s;
  s.tick_s = c.speed.period_s;
  s.current_A = m.start_A;
  s.hand_over_rad_s = hand_over_e * c.over_pole_pairs;
  s.give_up_rad_s = 1.67f * s.hand_over_rad_s;
  s.catch_speed_rad_s = 1.6f * s.hand_over_rad_s;
  s.backward_speed_rad_s = 4.0f * s.hand_over_rad_s;
  s.lead_e_s = 0.004f * c.pole_pairs;
  s.swing_V = 0.1f * hand_over_e * p.flux_linkage_Wb;
  s.catch_filter = clamp(400.0f * s.tick_s, 0.02f, 0.5f);
  s.catch_s = clamp(13.0f / hand_over_e, 0.015f, 0.1f);
  // The swing dies within about two and a half of its periods.
  s.align_first_s = clamp(9.0f * over_swing_s, 0.05f, 0.3f);
  s.align_second_s = clamp(14.3f * over_swing_s, 0.08f, 0.5f);
  s.align_rise_s = 0.4f * s.align_first_s;
  s.measure_window_s = 0.19f * s.align_second_s;
  // A share of the acceleration that the current can give, and at least four electrical turns on the way to the hand-over.
  const float most_rad_s2 = 0.2f * m.torque_constant_N_m_A * m.start_A / p.inertia_kg_m2;
  const float turns_rad_s2 = s.hand_over_rad_s * s.hand_over_rad_s * c.pole_pairs * (1.0f / 50.0f);
  s.acceleration_rad_s2 = most_rad_s2 < turns_rad_s2 ? most_rad_s2 : turns_rad_s2;
  // A quarter of critical damping: at a tenth a rotor that began far off still swings past the opposite dead point when the current falls.
  s.damping_A_V = 0.5f * p.inertia_kg_m2 * m.swing_rad_s / (m.torque_constant_N_m_A * p.flux_linkage_Wb * c.pole_pairs);
  s.damping_most_A = 0.67f * m.start_A;
  s.damping_corner_rad_s = 0.168f * m.swing_rad_s;
  // Faster than the swing, and the damping current's own inductive voltage would feed the damper.
  c.across_filter = clamp(2.23f * m.swing_rad_s * c.period_s, 1e-3f, 0.2f);
  s.hand_over_s = clamp(1.8f * over_swing_s, 0.005f, 0.05f);
  // Four of the shorted motor's time constants at most: a rotor that is still fast meets no alignment.
  const float shorted_s = p.inertia_kg_m2 * resistance_ohm / (m.torque_constant_N_m_A * p.flux_linkage_Wb * c.pole_pairs);
  s.short_brake_s = clamp(4.0f * shorted_s, 0.02f, 1.0f);
  s.rest_A = 0.1f * m.start_A > 2.0f * offset_A ? 0.1f * m.start_A : 2.0f * offset_A;
  s.short_catch_speed_rad_s = 1.1f * s.hand_over_rad_s;
}

template <Board B>
constexpr void configure_protection(const Parameters& p, const MotorScale& m, float resistance_ohm, MotorConfig& c) {
  const float A_per_count = magnitude(B::kCurrent_A_per_count), tick_s = c.speed.period_s;
  LimitConfig& l = c.limits;
  l.power = {resistance_ohm, m.torque_constant_N_m_A};
  l.brake = {0.8f * resistance_ohm, m.torque_constant_N_m_A};
  l.phase_A = p.phase_current_limit_A;
  l.source_A = p.bus_current_limit_A;
  l.sink_A = p.regen_current_limit_A;
  l.undervoltage_V = undervoltage_V(p);
  l.over_undervoltage_span = 1.0f / (p.cells > 0 ? kDeratingPerCell_V * static_cast<float>(p.cells) : 1.2f);
  l.temperature_K = p.temperature_limit_K;
  // A 20 % error of R must stay below 40 % of the back-EMF: 0.2 R i < 0.4 w_e flux.
  l.observer_A_s_rad = 2.0f * c.pole_pairs * p.flux_linkage_Wb / resistance_ohm;
  l.observer_min_A = 0.5f * m.start_A;

  ProtectionConfig& s = c.protection;
  s.trip_A = B::kTripCurrent_A;
  s.undervoltage_V = undervoltage_V(p);
  s.overvoltage_V = p.overvoltage_V;
  s.temperature_K = p.temperature_limit_K;
  s.residual_A = 68.0f * A_per_count;
  s.min_speed_rad_s = 0.5f * p.min_speed_rad_s;
  s.excused_V = p.flux_linkage_Wb * m.hand_over_e_rad_s * (1.0f / 3.0f);
  // In electrical acceleration: a third of the start current's, which friction, cogging and a wrong inertia stay below.
  s.slip_rad_s2 = 0.3f * c.pole_pairs * m.torque_constant_N_m_A * m.start_A / p.inertia_kg_m2;
  s.slip_speed_rad_s = 2.0f * c.start.hand_over_rad_s;
  s.slip_ticks = ticks(0.060f, tick_s);
  s.slow_ticks = ticks(0.002f, tick_s);
  s.sensor_ticks = ticks(0.004f, tick_s);
  s.stall_ticks = ticks(0.004f, tick_s);
  s.pause_ticks = ticks(0.010f, tick_s);
  s.healthy_ticks = ticks(1.0f, tick_s);
  s.trying_ticks = ticks(4.0f, tick_s);
  s.mismatch_rate = 400.0f * tick_s;
}

template <Board B>
SelfTestConfig configure_self_test(const Parameters& p, const MotorConfig& c) {
  const float A_per_count = magnitude(B::kCurrent_A_per_count), counts_s = c.modulator.top * static_cast<float>(B::kPwm_Hz);
  SelfTestConfig s;
  s.wanted = p.self_test && c.problem == ParameterProblem::none;
  s.top = c.modulator.top;
  s.period_s = c.period_s;
  s.counts_s = counts_s;
  s.pulses = static_cast<float>(B::kPwmPeriodsPerSample);
  s.dead_counts = c.modulator.dead_share * s.top;
  s.window_counts = 1e-9f * static_cast<float>(B::kSampleWindow_ns) * counts_s;
  s.most_counts = c.modulator.sample_duty * s.top;
  s.line_ohm = 2.0f * (p.resistance_ohm + B::kSwitchResistance_ohm);
  s.line_H = 2.0f * p.inductance_H;
  s.diode_V = B::kDiodeDrop_V;
  // Pulses lie in the middle of their periods, the sample at the end of the last; by then resistance has taken its share.
  const float half = 0.5f * s.line_ohm / (s.line_H * static_cast<float>(B::kPwm_Hz));
  s.left = B::kPwmPeriodsPerSample == 2 ? 0.5f * (exp_minus(half) + exp_minus(3.0f * half)) : exp_minus(half);
  // Eight times a converter's noise of two counts for one sample; for two in a row half of that is enough.
  s.wanted_A = 16.0f * A_per_count > 0.6f ? 16.0f * A_per_count : 0.6f;
  s.least_A = 8.0f * A_per_count;
  s.alone_A = 0.5f * B::kTripCurrent_A;
  s.wait_ticks = ticks(1.0f, c.speed.period_s);
  s.late_us = static_cast<std::uint32_t>(2.5e6f * c.period_s);
  return s;
}

// Always a configuration that can be run with; Motor refuses to start when `problem` says so.
template <Board B>
MotorConfig configure(const Parameters& asked) {
  MotorConfig c;
  c.problem = problem_of<B>(asked);
  const Parameters p = c.problem == ParameterProblem::motor_not_positive ? Parameters{} : asked;
  c.period_s = sample_s<B>();
  c.pole_pairs = static_cast<float>(p.pole_pairs);
  c.over_pole_pairs = 1.0f / c.pole_pairs;
  const float resistance = p.resistance_ohm + B::kSwitchResistance_ohm;
  configure_sensing<B>(p, c);
  const MotorScale m = motor_scale(p, resistance, kDrift_counts * magnitude(B::kCurrent_A_per_count), c.modulator.zone_A);
  configure_speed_loop(p, m, c);
  configure_observer(p, m, resistance, c);
  configure_start(p, m, resistance, 20.0f * magnitude(B::kCurrent_A_per_count), c);
  configure_protection<B>(p, m, resistance, c);

  c.current.decay = exp_minus(resistance * c.period_s / p.inductance_H);
  c.current.gain_V_A = kCurrentLoopGain * resistance / (1.0f - c.current.decay);
  c.current.flux_linkage_Wb = p.flux_linkage_Wb;
  c.current.period_s = c.period_s;
  c.over_resistance = 1.0f / resistance;
  c.rad_s2_A = c.pole_pairs * m.torque_constant_N_m_A / p.inertia_kg_m2;
  c.load_e_1_rad = p.load_N_m_s2 / (p.inertia_kg_m2 * c.pole_pairs);

  const float tick_s = c.speed.period_s;
  c.resistance.least_ohm = kResistanceLeast * resistance;
  c.resistance.most_ohm = kResistanceMost * resistance;
  // A second at changes that move the flux ratio as 20 % of R at a third of the rated current does.
  c.resistance.learn_ohm_A_s = 5.7f * resistance * resistance * tick_s / (p.flux_linkage_Wb * 1.0f);
  c.resistance.mean = 20.0f * tick_s;
  c.resistance.least_change_A_s = 0.187f * p.flux_linkage_Wb / resistance;
  c.resistance.least_omega_e_rad_s = 1.7f * m.hand_over_e_rad_s;
  c.health = {tick_s, 10.0f * tick_s, B::kSwitchResistance_ohm, p.inertia_kg_m2, p.inertia_kg_m2 * c.over_pole_pairs, p.load_N_m_s2};
  c.stop = {p.stop_mode, clamp(p.stop_strength, 0.0f, 1.0f) * p.phase_current_limit_A, 0.35f * m.start_A};
  // Flights of 300 drawn 3-inch and 300 5-inch motors without a trip: 299 and 287; 0.6 of the start current 297 and 285, all of it 298
  // and 285; full up to 2.5 and gone at 5 times the hand-over's speed 300 and 277.
  c.hold.current_A = 0.8f * m.start_A;
  c.hold.full_rad_s = 2.0f * c.start.hand_over_rad_s;
  c.hold.none_rad_s = 4.0f * c.start.hand_over_rad_s;
  c.hold.over_fade_s = 1.0f / (c.hold.none_rad_s - c.hold.full_rad_s);
  c.hold.most_step_A = m.start_A * tick_s / c.start.hand_over_s;
  c.bus_filter = clamp(6000.0f * c.period_s, 0.1f, 0.5f);
  c.bus_jump_V = 0.06f * p.overvoltage_V < 1.0f ? 1.0f : 0.06f * p.overvoltage_V;
  c.weaken_A_per_V = 0.6f * (0.064f / resistance) * (tick_s * 4000.0f);
  c.weaken_most_A = clamp(p.weaken_most_A, 0.0f, 0.5f * p.phase_current_limit_A);
  c.most_step_A = 2.0f * p.phase_current_limit_A * tick_s / kCurrentSwing_s;
  c.order_ticks = ticks(kOrderLife_s, tick_s);
  c.late_us = static_cast<std::uint32_t>(1e6f * (tick_s + 0.5f * c.period_s));
  return c;
}

}  // namespace rotorloop::firmware
