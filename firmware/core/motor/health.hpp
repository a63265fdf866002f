// What the motor control knows beside speed and current: energy, mean bus current, winding temperature, torque at the shaft.
#pragma once
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/angle.hpp"

namespace rotorloop::firmware {

struct HealthConfig {
  float tick_s = 0.0f;
  float mean_rate = 0.0f;                        // of the averaged bus current, per tick
  float switch_ohm = 0.0f;                       // part of the measured resistance that is no copper
  float inertia_kg_m2 = 0.0f, inertia_e = 0.0f;  // … and over pole pairs: N m per electrical rad/s²
  float load_N_m_s2 = 0.0f;
};

struct HealthState {
  float bus_mean_A = 0.0f;
  float energy_J = 0.0f, energy_rest_J = 0.0f;  // the rest: too small to be added to a large float
  float cold_ohm = 0.0f, cold_K = 0.0f;         // winding at the first start, at the board's temperature
  float winding_K = 0.0f, winding_error_K = 0.0f;
  float load_N_m = 0.0f;
  float duty_q = 0.0f;  // line-to-line voltage along the torque axis, over the bus voltage, averaged
};

constexpr float kCopper_K = 234.5f;        // resistance is proportional to the temperature over -234.5 degC
constexpr float kResistanceError = 0.15f;  // what an alignment and the following keep to (test hot_motor_test)

constexpr void count_energy(const HealthConfig& c, HealthState& s, float bus_V, float bus_A) {
  s.bus_mean_A += c.mean_rate * (bus_A - s.bus_mean_A);
  s.energy_rest_J += bus_V * bus_A * c.tick_s;
  if (magnitude(s.energy_rest_J) > 1.0f) {
    s.energy_J += s.energy_rest_J;
    s.energy_rest_J = 0.0f;
  }
}

// What a stand needs for R and K_v, whatever the gain of the divider: the voltage after dead-time compensation as a share of the bus.
constexpr void average_duty(const HealthConfig& c, HealthState& s, float line_q_V, float bus_V) {
  s.duty_q += c.mean_rate * (magnitude(line_q_V) / (bus_V > 1.0f ? bus_V : 1.0f) - s.duty_q);
}

// The first measurement of a motor that has not run: copper as warm as the board.
constexpr void remember_cold(const HealthConfig& c, HealthState& s, float measured_ohm, float board_K) {
  if (s.cold_ohm > 0.0f || measured_ohm <= c.switch_ohm) return;
  s.cold_ohm = measured_ohm - c.switch_ohm;
  s.cold_K = board_K;
}

constexpr void estimate_winding(const HealthConfig& c, HealthState& s, float resistance_ohm) {
  if (!(s.cold_ohm > 0.0f)) return;
  const float zero_K = 273.15f - kCopper_K, over_cold = 1.0f / s.cold_ohm, scale = (s.cold_K - zero_K) * over_cold;
  s.winding_K = zero_K + scale * (resistance_ohm - c.switch_ohm);
  // Both measurements err, and the winding at the first start may have differed from the board by 10 K.
  s.winding_error_K = 10.0f + 1.4f * kResistanceError * resistance_ohm * scale;
}

constexpr float kBusMeanRate_1_s = 10.0f;  // tuned on the simulated drive, 2026-11-23

constexpr HealthConfig configure_health(const Parameters& p, float switch_ohm, float tick_s, float over_pole_pairs) {
  return {tick_s, kBusMeanRate_1_s * tick_s, switch_ohm, p.inertia_kg_m2, p.inertia_kg_m2 * over_pole_pairs, p.load_N_m_s2};
}

}  // namespace rotorloop::firmware
