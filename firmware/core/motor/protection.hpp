// What switches the bridge off. Fast checks run on every sample and act in the same interrupt (over-current, over-voltage); slow
// ones once per supervision tick with a persistence. Every fault ends by itself: a pause, then a new start; after several in a
// row, or 4 s of trying, the fault is latched until the set-point returns to off. docs/acceptance/esc_protections.md has each with its
// limits.
#pragma once
#include <cstdint>

#include "firmware/core/interface.hpp"
#include "firmware/core/motor/angle.hpp"
#include "firmware/core/motor/current_sense.hpp"
#include "firmware/core/motor/motor_scale.hpp"
#include "firmware/core/motor/timing.hpp"

namespace rotorloop::firmware {

// How long each lasts until it counts, and the shares of the motor's own quantities; docs/acceptance/esc_protections.md shows what they
// reach. Tuned on the simulated drive, 2026-11-23; restarts, lock and mismatch 2026-11-21.
constexpr float kSlip_s = 0.060f, kSlow_s = 0.002f, kSensor_s = 0.004f, kStall_s = 0.004f;  // slow: undervoltage, temperature
constexpr float kFaultPause_s = 0.010f;                                                     // from a fault to the next start
constexpr float kHealthy_s = 1.0f;                                                          // of running forgives earlier faults
constexpr float kTrying_s = 4.0f;           // of faults and starts without that: given up at the next fault …
constexpr std::uint16_t kMostRestarts = 8;  // … or after as many
constexpr float kResidual_counts = 68.0f;   // mean |sum of phase currents| that tolerance cannot explain
constexpr float kStallSpeed = 0.5f;         // of the lowest speed
constexpr float kExcusedEmf = 1.0f / 3.0f;  // of the back-EMF at the hand-over: dead time
constexpr float kSlipTorque = 0.3f;         // of the start current's, which friction, cogging and a wrong inertia stay below
constexpr float kSlipSpeed = 2.0f;          // of the hand-over's
constexpr float kMismatchRate_1_s = 400.0f;
constexpr float kMinLock = 0.75f;
constexpr float kMostMismatch = 0.6f;  // |measured - expected back-EMF| / expected, beyond what a resistance error explains
constexpr float kHysteresis_V = 0.5f, kHysteresis_K = 5.0f;

struct ProtectionConfig {
  float trip_A = 0.0f;
  bool trip_at_range_end = true;  // false only to show what it prevents
  float undervoltage_V = 0.0f, overvoltage_V = 0.0f;
  float temperature_K = 0.0f;
  float residual_A = 0.0f, residual_share = 0.08f;  // mean |sum of phase currents|: A, and of |i|
  float min_speed_rad_s = 0.0f;                     // below it a running motor is stalled
  float excused_V = 0.0f;
  float mismatch_rate = 0.0f;  // filter, per supervision tick
  // Below this speed, a torque that accelerates nothing turns no rotor: electrical rad/s² that stay unexplained.
  float slip_rad_s2 = 0.0f, slip_speed_rad_s = 0.0f;
  std::uint16_t slip_ticks = 0, slow_ticks = 0, sensor_ticks = 0, stall_ticks = 0, pause_ticks = 0, healthy_ticks = 0, trying_ticks = 0;
};

template <Board B>
constexpr void configure_protection(const Parameters& p, const MotorScale& m, float tick_s, ProtectionConfig& s) {
  const float pole_pairs = static_cast<float>(p.pole_pairs);
  s.trip_A = B::kTripCurrent_A;
  s.undervoltage_V = undervoltage_V(p);
  s.overvoltage_V = p.overvoltage_V;
  s.temperature_K = p.temperature_limit_K;
  s.residual_A = kResidual_counts * magnitude(B::kCurrent_A_per_count);
  s.min_speed_rad_s = kStallSpeed * p.min_speed_rad_s;
  s.excused_V = p.flux_linkage_Wb * m.hand_over_e_rad_s * kExcusedEmf;
  s.slip_rad_s2 = kSlipTorque * pole_pairs * m.torque_constant_N_m_A * m.start_A / p.inertia_kg_m2;
  s.slip_speed_rad_s = kSlipSpeed * (m.hand_over_e_rad_s * (1.0f / pole_pairs));
  s.slip_ticks = ticks(kSlip_s, tick_s);
  s.slow_ticks = ticks(kSlow_s, tick_s);
  s.sensor_ticks = ticks(kSensor_s, tick_s);
  s.stall_ticks = ticks(kStall_s, tick_s);
  s.pause_ticks = ticks(kFaultPause_s, tick_s);
  s.healthy_ticks = ticks(kHealthy_s, tick_s);
  s.trying_ticks = ticks(kTrying_s, tick_s);
  s.mismatch_rate = kMismatchRate_1_s * tick_s;
}

struct ProtectionState {
  Fault fault = Fault::none;
  bool latched = false;
  std::uint16_t under_ticks = 0, hot_ticks = 0, residual_ticks = 0, stall_ticks = 0, slip_ticks = 0, thermistor_ticks = 0;
  std::uint16_t pause_ticks = 0, healthy_ticks = 0, restarts = 0, trying_ticks = 0;
  std::uint32_t trips = 0;
  bool thermistor_lost = false;
};

// Every sample, before anything else. `none` when all is well.
constexpr Fault check_fast(const ProtectionConfig& c, const Sensed& sensed, float bus_V) {
  bool over = sensed.at_end_of_range && c.trip_at_range_end;
  for (const float i : sensed.phase_A) over |= magnitude(i) > c.trip_A;
  return over ? Fault::overcurrent : bus_V > c.overvoltage_V ? Fault::overvoltage : Fault::none;
}

struct SlowInputs {
  float bus_V = 0.0f, temperature_K = 0.0f, residual_A = 0.0f, current_A = 0.0f;
  bool running = false;  // under the observer: stall detection is meaningful
  float speed_rad_s = 0.0f, direction = 1.0f, lock = 0.0f, emf_mismatch = 0.0f, unknown_rad_s2 = 0.0f;
};

constexpr void persist(std::uint16_t& ticks, bool bad) {
  ticks = bad ? static_cast<std::uint16_t>(ticks < 60000 ? ticks + 1 : ticks) : std::uint16_t{0};
}

constexpr Fault check_slow(const ProtectionConfig& c, ProtectionState& s, const SlowInputs& in) {
  persist(s.under_ticks, in.bus_V < c.undervoltage_V);
  persist(s.hot_ticks, in.temperature_K > c.temperature_K);
  persist(s.residual_ticks, in.residual_A > c.residual_A + c.residual_share * in.current_A);
  const bool lost = in.speed_rad_s * in.direction < c.min_speed_rad_s || in.lock < kMinLock || in.emf_mismatch > kMostMismatch;
  persist(s.stall_ticks, in.running && lost);
  const bool slips = magnitude(in.speed_rad_s) < c.slip_speed_rad_s && magnitude(in.unknown_rad_s2) > c.slip_rad_s2;
  persist(s.slip_ticks, in.running && slips);
  if (s.under_ticks >= c.slow_ticks) return Fault::undervoltage;
  if (s.hot_ticks >= c.slow_ticks) return Fault::overtemperature;
  if (s.residual_ticks >= c.sensor_ticks) return Fault::sensor;
  if (s.stall_ticks >= c.stall_ticks || s.slip_ticks >= c.slip_ticks) return Fault::stall;
  return Fault::none;
}

// How far the measured back-EMF is from the expected one, beyond what is excused; at most 3.
constexpr float mismatch_of(float emf_V, float expected_V, float excused_V) {
  const float excess_V = magnitude(emf_V - expected_V) - excused_V;
  const float mismatch = excess_V > 0.0f ? excess_V / (magnitude(expected_V) + 0.5f * excused_V) : 0.0f;
  return mismatch < 3.0f ? mismatch : 3.0f;
}

constexpr float largest_A(const Sensed& s) {
  const float u = magnitude(s.phase_A[0]), v = magnitude(s.phase_A[1]), w = magnitude(s.phase_A[2]);
  const float most = u > v ? u : v;
  return most > w ? most : w;
}

// An open or shorted thermistor reads the end of the converter's range. Told by and by, both ways.
constexpr void watch_thermistor(const ProtectionConfig& c, ProtectionState& s, std::uint16_t counts) {
  const bool at_end = counts <= 8 || counts >= 4087;
  persist(s.thermistor_ticks, at_end != s.thermistor_lost);
  if (s.thermistor_ticks < c.sensor_ticks) return;
  s.thermistor_lost = at_end;
  s.thermistor_ticks = 0;
}

// Is a fault forgiven by trying again, or is it given up? Supply and temperature faults wait for their cause to go.
constexpr bool gives_up(const ProtectionConfig& c, ProtectionState& s, Fault fault) {
  if (fault == Fault::undervoltage || fault == Fault::overvoltage || fault == Fault::overtemperature) return false;
  ++s.restarts;
  return s.restarts > kMostRestarts || s.trying_ticks >= c.trying_ticks;
}

// Why a stopped motor may not start (again).
constexpr Blocked blocked_by(const ProtectionConfig& c, const ProtectionState& s, float bus_V, float temperature_K) {
  if (s.latched) return Blocked::latched;
  if (!(bus_V < c.overvoltage_V - (s.fault == Fault::overvoltage ? kHysteresis_V : 0.0f))) return Blocked::overvoltage;
  if (!(bus_V > c.undervoltage_V + (s.fault == Fault::undervoltage ? kHysteresis_V : 0.0f))) return Blocked::undervoltage;
  if (s.fault == Fault::overtemperature && temperature_K >= c.temperature_K - kHysteresis_K) return Blocked::overtemperature;
  if (temperature_K > c.temperature_K) return Blocked::overtemperature;
  // In flight a lost thermistor costs half the current; on the ground it is mended first.
  if (s.thermistor_lost && s.restarts == 0) return Blocked::temperature_sensor;
  return s.pause_ticks > 0 ? Blocked::pause : Blocked::none;
}

}  // namespace rotorloop::firmware
