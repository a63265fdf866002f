// Parameters (what a user sets) and the board's constants, turned once into what every block of the motor control needs: whatever the
// interrupt would divide by is divided here, every number of samples is made of seconds, and every rate scales with the motor
// (motor_scale.hpp). Each block's numbers stand beside the block, as its configure_…(); here are those of what holds them together.
#pragma once
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/current_loop.hpp"
#include "firmware/core/motor/current_sense.hpp"
#include "firmware/core/motor/dead_time.hpp"
#include "firmware/core/motor/health.hpp"
#include "firmware/core/motor/hold_current.hpp"
#include "firmware/core/motor/limits.hpp"
#include "firmware/core/motor/modulator.hpp"
#include "firmware/core/motor/motor_scale.hpp"
#include "firmware/core/motor/observer.hpp"
#include "firmware/core/motor/protection.hpp"
#include "firmware/core/motor/resistance.hpp"
#include "firmware/core/motor/rotor_finder.hpp"
#include "firmware/core/motor/sample_check.hpp"
#include "firmware/core/motor/self_test.hpp"
#include "firmware/core/motor/speed_loop.hpp"
#include "firmware/core/motor/start_up.hpp"
#include "firmware/core/motor/timing.hpp"

namespace rotorloop::firmware {

// The main loop writes a set-point with every poll; after this long without one that is finite the motor coasts (two missed polls).
constexpr float kOrderLife_s = 0.020f;

// Of a current amplifier's zero within the seconds of a start.
constexpr float kDrift_counts = 5.0f;
// The torque current is led from one limit to the other within this time: faster, and the part of the inductance that the parameters
// have wrong would turn the observer by as much as it turns in a whole period of the phase-locked loop.
constexpr float kCurrentSwing_s = 0.002f;

// Tuned on the simulated drive, 2026-11-23 where no other date stands.
constexpr float kHandOverShare = 0.5f, kUnmeasuredShare = 0.7f;  // of the torque current while an estimate is young; 2026-11-26
constexpr float kToneShare = 0.35f;                              // of the start current
constexpr float kBusRate_1_s = 6000.0f;                          // of the bus's filter: 0.16 ms
constexpr float kBusJump = 0.06f, kBusJump_V = 1.0f;             // of the overvoltage; at least
constexpr float kWeakenMargin = 0.95f;                           // of the voltage limit, at which field weakening begins; 2026-11-21
constexpr float kWeaken_A_per_V = 0.6f, kWeakenAt_ohm = 0.064f,
                kWeakenAt_Hz = 4000.0f;  // integral of the reference motor, scaled by R and tick
constexpr float kWeakenMost = 0.5f;      // of the phase current limit

struct StopConfig {
  StopMode mode = StopMode::coast;
  float current_A = 0.0f;
  float tone_A = 0.0f;
};

struct MotorConfig {
  ParameterProblem problem = ParameterProblem::none;
  float period_s = 0.0f;  // of the current loop
  float pole_pairs = 0.0f, over_pole_pairs = 0.0f;
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
  float hand_over_share = kHandOverShare, unmeasured_share = kUnmeasuredShare;
  float rad_s2_A = 0.0f;      // electrical acceleration per torque current …
  float load_e_1_rad = 0.0f;  // … and lost to the propeller, per electrical speed²
  float over_resistance = 0.0f;
  float weaken_A_per_V = 0.0f;  // field weakening integral, per supervision tick
  float weaken_most_A = 0.0f;
  float across_filter = 0.0f;  // voltage along and across the start vector
  float bus_filter = 0.0f;
  float bus_jump_V = 0.0f;  // of the bus between two samples that is accepted at once
  float weaken_margin = kWeakenMargin;
  float most_step_A = 0.0f;  // of the torque current, per supervision tick
  std::uint32_t order_ticks = 0;
  std::uint32_t late_us = 0;  // between two rounds of slots: one sample or more has been missed
  FinderConfig finder{};      // last: offsets of what runs stay small
};

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
  c.sense = configure_sense<B>(c.period_s);
  configure_sample_check<B>(p, c.period_s, c.check);
  c.modulator = configure_modulator<B>(p);
  c.dead_time = configure_dead_time(c.modulator.dead_share);
  const MotorScale m = motor_scale(p, resistance, kDrift_counts * magnitude(B::kCurrent_A_per_count), c.modulator.zone_A);
  configure_speed_loop(p, m, c.period_s, c.speed);
  const float tick_s = c.speed.period_s;
  configure_observer(p, m, resistance, c.period_s, kSpeedCorner * c.speed.feedback_rad_s, c.observer);
  configure_start<B>(p, m, resistance, tick_s, c.start);
  c.across_filter = across_filter(m, c.period_s);
  configure_limits(p, m, resistance, c.limits);
  configure_range<B>(p, c.period_s, c.limits);
  configure_protection<B>(p, m, tick_s, c.protection);
  c.current = configure_current_loop(p, resistance, c.period_s);
  c.resistance = configure_resistance(p, m, resistance, tick_s);
  c.health = configure_health(p, B::kSwitchResistance_ohm, tick_s, c.over_pole_pairs);
  c.hold = configure_hold(m, c.start.hand_over_rad_s, c.start.hand_over_s, tick_s);
  c.stop = {p.stop_mode, clamp(p.stop_strength, 0.0f, 1.0f) * p.phase_current_limit_A, kToneShare * m.start_A};
  c.over_resistance = 1.0f / resistance;
  c.rad_s2_A = c.pole_pairs * m.torque_constant_N_m_A / p.inertia_kg_m2;
  c.load_e_1_rad = p.load_N_m_s2 / (p.inertia_kg_m2 * c.pole_pairs);
  c.finder = configure_finder<B>(p, c.start, c.load_e_1_rad, c.period_s);
  c.bus_filter = clamp(kBusRate_1_s * c.period_s, 0.1f, 0.5f);
  c.bus_jump_V = kBusJump * p.overvoltage_V < kBusJump_V ? kBusJump_V : kBusJump * p.overvoltage_V;
  c.weaken_A_per_V = kWeaken_A_per_V * (kWeakenAt_ohm / resistance) * (tick_s * kWeakenAt_Hz);
  c.weaken_most_A = clamp(p.weaken_most_A, 0.0f, kWeakenMost * p.phase_current_limit_A);
  c.most_step_A = 2.0f * p.phase_current_limit_A * tick_s / kCurrentSwing_s;
  c.order_ticks = ticks(kOrderLife_s, tick_s);
  c.late_us = static_cast<std::uint32_t>(1e6f * (tick_s + 0.5f * c.period_s));
  return c;
}

}  // namespace rotorloop::firmware
