// Measurements of the closed RPM loop on the native ESC: one function per row of docs/acceptance/esc_rpm_loop.md.
#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "bench/hil/esc_lab/closed_loop.hpp"

namespace rotorloop::esc_lab {

using sim::NativeEsc, sim::NativeEscConfig;

constexpr double kTriblade_N_m_s2 = 2.9e-8;  // three-blade 5-inch propeller

using Change = std::function<void(NativeEsc&)>;  // an ablation

inline NativeEsc make_esc(NativeEscConfig c, double load_N_m_s2 = kTriblade_N_m_s2, const Change& change = {}) {
  NativeEsc esc(c);
  if (change) change(esc);
  esc.couple_quadratic(load_N_m_s2, c.bus_V);
  for (int k = 0; k < 60 * kPeriodsPerMs; ++k) esc.step_current_loop();  // boot: zeros of the current sensors, self-test
  return esc;
}

struct StepResult {
  double rise_ms = 0.0, settle_ms = 0.0, overshoot_percent = 0.0;
  double peak_current_A = 0.0;  // true |i_q|
  std::set<firmware::Limiter> limiters;
};

// Of an ESC that stands still and is ready, by whatever way set-points reach it.
template <class Esc>
StepResult step_of(Esc& esc, double from_rpm, double to_rpm) {
  esc.set_setpoint(speed(from_rpm * kRpm));
  run_ms(esc, 900.0);
  StepResult r;
  esc.set_setpoint(speed(to_rpm * kRpm));
  StepMeter meter(from_rpm, to_rpm);
  run_ms(esc, 300.0, [&](double t_ms) {
    meter.add(t_ms, esc.omega_rad_s() / kRpm);
    r.peak_current_A = std::max(r.peak_current_A, std::fabs(esc.drive().motor().state().i_q_A));
    if (esc.telemetry().limiter != firmware::Limiter::none) r.limiters.insert(esc.telemetry().limiter);
  });
  r.rise_ms = meter.rise_ms();
  r.settle_ms = meter.settle_ms();
  r.overshoot_percent = meter.overshoot_percent();
  return r;
}

inline StepResult measure_step(NativeEscConfig c, double from_rpm, double to_rpm, const Change& change = {}) {
  NativeEsc esc = make_esc(c, kTriblade_N_m_s2, change);
  return step_of(esc, from_rpm, to_rpm);
}

// Small sines of ±amplitude around a speed.
inline double measure_bandwidth_Hz(NativeEscConfig c, double centre_rpm, double amplitude_rpm, const Change& change = {}) {
  NativeEsc esc = make_esc(c, kTriblade_N_m_s2, change);
  esc.set_setpoint(speed(centre_rpm * kRpm));
  run_ms(esc, 900.0);
  return closed_loop_bandwidth(esc, centre_rpm * kRpm, amplitude_rpm * kRpm).minus_3dB_Hz;
}

struct SteadyResult {
  double mean_error_percent = 0.0, rms_percent = 0.0;
};

template <class Esc>
SteadyResult steady_of(Esc& esc, double rpm) {
  esc.set_setpoint(speed(rpm * kRpm));
  run_ms(esc, 1000.0);
  double sum = 0.0, sum2 = 0.0;
  int n = 0;
  run_ms(esc, 500.0, [&](double) {
    const double e = 100.0 * (esc.omega_rad_s() / kRpm / rpm - 1.0);
    sum += e;
    sum2 += e * e;
    ++n;
  });
  return {sum / n, std::sqrt(sum2 / n)};
}

inline SteadyResult measure_steady(NativeEscConfig c, double rpm, const Change& change = {}) {
  NativeEsc esc = make_esc(c, kTriblade_N_m_s2, change);
  return steady_of(esc, rpm);
}

// Bus from 4.2 to 3.5 V per cell in one second. Returns the largest deviation in percent of the speed before.
inline double measure_sag_percent(NativeEscConfig c, double rpm, bool open_loop = false) {
  c.bus_V = 16.8;
  NativeEsc esc = make_esc(c);
  esc.set_setpoint(speed(rpm * kRpm));
  run_ms(esc, 1000.0);
  if (open_loop) {  // the same speed, held by a fixed duty
    const auto& v = esc.motor().variables();
    const double limit_V = static_cast<double>(firmware::voltage_limit_V(esc.motor().config().modulator, v.bus_V));
    const double emf_V = esc.omega_rad_s() * 7.0 * 3.42e-4, i_q_A = static_cast<double>(v.wanted_A.q);
    esc.set_setpoint({firmware::Mode::duty, static_cast<float>((emf_V + 0.064 * i_q_A) / limit_V)});
    run_ms(esc, 1000.0);
  }
  return sag_percent(esc, kTriblade_N_m_s2, 16.8, 14.0);
}

struct StartResult {
  double reached_ms = 1e9;  // from set-point to 98 % of it
  bool held = false;        // within 2 % from 700 ms on
};

// Motor, supply and angle drawn from `seed`: R, L, flux each within +-20 % of what the firmware assumes, 3.5..4.2 V per cell.
inline NativeEscConfig spread_config(std::uint64_t seed) {
  NativeEscConfig c;
  c.seed = seed;
  const RandomStream draw(seed, 0x53505245);
  const auto factor = [&](std::uint64_t k) { return 0.8 + 0.4 * draw.uniform(k); };
  c.drive.motor.resistance_ohm *= factor(0);
  const double inductance = factor(1);
  c.drive.motor.inductance_H.d *= inductance;
  c.drive.motor.inductance_H.q *= inductance;
  c.drive.motor.flux_linkage_Wb *= factor(2);
  c.bus_V = 4.0 * (3.5 + 0.7 * draw.uniform(3));
  return c;
}

template <class Esc>
StartResult start_of(Esc& esc, double rpm) {
  esc.set_setpoint(speed(rpm * kRpm));
  StartResult r;
  r.held = true;
  run_ms(esc, 1000.0, [&](double t_ms) {
    const double x = esc.omega_rad_s() / (rpm * kRpm);
    if (x >= 0.98 && r.reached_ms > 1e8) r.reached_ms = t_ms;
    if (t_ms > 700.0 && std::fabs(x - 1.0) > 0.02) r.held = false;
  });
  return r;
}

inline StartResult measure_start(std::uint64_t seed, double rpm, const Change& change = {}) {
  NativeEsc esc = make_esc(spread_config(seed), kTriblade_N_m_s2, change);
  return start_of(esc, rpm);
}

struct FastResult {
  double speed_keRPM = 0.0, mean_error_percent = 0.0, worst_error_percent = 0.0, worst_angle_rad = 0.0;
  bool locked = false;
};

// Light load, current mode up to the speed at which the firmware's speed limit fades the torque out.
inline FastResult measure_fast(NativeEscConfig c, double electrical_krpm, const Change& change = {}) {
  const double target_rad_s = electrical_krpm * 1000.0 * kRpm / 7.0;
  c.bus_V = 16.8;
  c.firmware.max_speed_rad_s = static_cast<float>(target_rad_s);
  c.firmware.load_N_m_s2 = 2e-9f;
  NativeEsc esc = make_esc(c, 2e-9, change);
  esc.set_setpoint({firmware::Mode::current, 12.0f});
  run_ms(esc, 1800.0);
  FastResult r;
  double sum = 0.0;
  int n = 0;
  for (int k = 0; k < 200 * kPeriodsPerMs; ++k) {
    const sim::MotorState truth = esc.drive().motor().state();  // at the instant of the sample
    esc.step_current_loop();
    const auto& o = esc.motor().variables().observer;
    const double error = 100.0 * (static_cast<double>(o.speed_e_rad_s) / (7.0 * truth.omega_rad_s) - 1.0);
    sum += error;
    ++n;
    r.worst_error_percent = std::max(r.worst_error_percent, std::fabs(error));
    const double angle = std::remainder(static_cast<double>(o.angle.rad()) - std::atan2(truth.sin_e, truth.cos_e), 2.0 * std::numbers::pi);
    r.worst_angle_rad = std::max(r.worst_angle_rad, std::fabs(angle));
  }
  r.speed_keRPM = esc.omega_rad_s() * 7.0 / kRpm / 1000.0;
  r.mean_error_percent = sum / n;
  r.locked = esc.telemetry().speed_valid;
  return r;
}

}  // namespace rotorloop::esc_lab
