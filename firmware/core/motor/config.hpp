// Parameters (what a user sets) and the board's constants, turned once into what every block of the motor control needs.
#pragma once
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/current_loop.hpp"
#include "firmware/core/motor/current_sense.hpp"
#include "firmware/core/motor/limits.hpp"
#include "firmware/core/motor/modulator.hpp"
#include "firmware/core/motor/observer.hpp"
#include "firmware/core/motor/protection.hpp"
#include "firmware/core/motor/resistance.hpp"
#include "firmware/core/motor/speed_loop.hpp"
#include "firmware/core/motor/start_up.hpp"

namespace rotorloop::firmware {

// The RPM loop and all supervision run once every kSlots samples, each job in its own sample so that no interrupt is long.
constexpr std::uint32_t kSlots = 6;

struct MotorConfig {
  float period_s = 0.0f;  // of the current loop
  float pole_pairs = 7.0f;
  SenseConfig sense{};
  ModulatorConfig modulator{};
  CurrentLoopConfig current{};
  ObserverConfig observer{};
  LimitConfig limits{};
  SpeedLoopConfig speed{};
  StartConfig start{};
  ProtectionConfig protection{};
  ResistanceConfig resistance{};
  bool compensate_delay = true;  // false only to show what it prevents
  float weaken_A_per_V = 0.6f;   // field weakening integral, per supervision tick
  float weaken_most_A = 0.0f;
  // Voltage across the start vector, smoothed at 400 rad/s: faster, and the damping current's own inductive voltage would feed
  // the damper (40 A/V · 15 uH · 400 rad/s = 0.24 < 1).
  float across_filter = 400.0f / 24000.0f;
  float weaken_margin = 0.95f;  // of the voltage limit at which it begins
};

// exp(-x) for 0 <= x <= 1, Padé (2,2): error below 1e-3 at 1, 1e-6 at 0.2.
constexpr float exp_minus(float x) { return (1.0f - 0.5f * x + x * x * (1.0f / 12)) / (1.0f + 0.5f * x + x * x * (1.0f / 12)); }

template <Board B>
constexpr MotorConfig configure(const Parameters& p) {
  MotorConfig c;
  c.period_s = static_cast<float>(B::kPwmPeriodsPerSample) / static_cast<float>(B::kPwm_Hz);
  c.pole_pairs = static_cast<float>(p.pole_pairs);
  const float pwm_s = 1.0f / static_cast<float>(B::kPwm_Hz), dead_s = 1e-9f * static_cast<float>(B::kDeadTime_ns);
  const float resistance = p.resistance_ohm + B::kSwitchResistance_ohm;
  const float torque_constant = 1.5f * c.pole_pairs * p.flux_linkage_Wb;

  // Half of the low side's time lies before the sample.
  const float sample_duty = 1.0f - (2e-9f * static_cast<float>(B::kSampleWindow_ns) + dead_s) / pwm_s;
  c.sense = {B::kCurrent_A_per_count, B::kCurrentZero_counts, B::kCurrentZeroTolerance_counts,
             static_cast<std::uint16_t>(sample_duty * static_cast<float>(B::kPwmTop))};
  c.modulator = {static_cast<float>(B::kPwmTop), dead_s / pwm_s, B::kDiodeDrop_V, 1.2f, sample_duty};

  c.current.decay = exp_minus(resistance * c.period_s / p.inductance_H);
  c.current.gain_V_A = 0.25f * resistance / (1.0f - c.current.decay);
  c.current.flux_linkage_Wb = p.flux_linkage_Wb;
  c.current.period_s = c.period_s;

  c.observer.period_s = c.period_s;
  c.observer.resistance_ohm = resistance;
  c.observer.inductance_H = p.inductance_H;
  c.observer.flux_linkage_Wb = p.flux_linkage_Wb;

  c.limits.power = {resistance, torque_constant};
  c.limits.phase_A = p.phase_current_limit_A;
  c.limits.source_A = p.bus_current_limit_A;
  c.limits.sink_A = p.regen_current_limit_A;
  c.limits.undervoltage_V = p.undervoltage_V;
  c.limits.temperature_K = p.temperature_limit_K;
  // A 20 % error of R must stay below 40 % of the back-EMF: 0.2 R i < 0.4 w_e flux.
  c.limits.observer_A_s_rad = 2.0f * c.pole_pairs * p.flux_linkage_Wb / resistance;

  c.speed.period_s = c.period_s * static_cast<float>(kSlots);
  c.speed.torque_constant_N_m_A = torque_constant;
  c.speed.inertia_kg_m2 = p.inertia_kg_m2;
  c.speed.load_N_m_s2 = p.load_N_m_s2;
  c.speed.slew_rad_s2 = p.speed_slew_rad_s2;
  c.speed.max_speed_rad_s = p.max_speed_rad_s;
  c.speed.min_speed_rad_s = p.min_speed_rad_s;

  c.start.tick_s = c.speed.period_s;
  c.start.current_A = 12.0f < 0.5f * p.phase_current_limit_A ? 12.0f : 0.5f * p.phase_current_limit_A;
  c.resistance.least_ohm = kResistanceLeast * resistance;
  c.resistance.most_ohm = kResistanceMost * resistance;
  c.resistance.learn_ohm_A_s = 50.0f * p.flux_linkage_Wb;  // a second at changes of 10 A and 5 000 electrical rad/s
  c.protection.trip_A = B::kTripCurrent_A;
  c.protection.undervoltage_V = p.undervoltage_V;
  c.protection.overvoltage_V = p.overvoltage_V;
  c.protection.temperature_K = p.temperature_limit_K;
  c.protection.min_speed_rad_s = 0.5f * p.min_speed_rad_s;
  c.weaken_most_A = 0.5f * p.phase_current_limit_A;
  return c;
}

}  // namespace rotorloop::firmware
