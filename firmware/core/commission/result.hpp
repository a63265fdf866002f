// What a commissioning is asked for, what it found, and what of it becomes parameters. Plain data: the node, a host and a test need
// nothing else of this folder.
#pragma once
#include <array>
#include <cstdint>

#include "firmware/core/interface.hpp"

namespace rotorloop::firmware {

enum class CommissioningTask : std::uint8_t {
  off,
  standstill,  // R, L_d, L_q, dead time, zeros: the rotor is pulled through one electrical turn, no faster than a hand turns it
  all,         // … then flux, inertia, friction and load: the motor spins
};

// The answer of whoever watches the motor spin.
enum class SeenDirection : std::uint8_t { not_seen, as_wanted, reversed };

// From the main loop, again and again: an order not renewed within kOrderLife_s (config.hpp) ends the commissioning with the bridge off.
// A finished or aborted one begins again only after an order `off`.
struct CommissioningOrder {
  CommissioningTask task = CommissioningTask::off;
  float speed_constant_rpm_V = 0.0f;  // K_v by the label; 0: not known, not compared
  float bell_inertia_kg_m2 = 0.0f;    // rotor without propeller; 0: not known, not compared
  bool wait_for_reference = false;    // hold the speed until it was counted, at most 30 s
  float counted_rad_s = 0.0f;         // mechanical speed counted while `speed_held`; 0: nobody counted
  SeenDirection direction = SeenDirection::not_seen;
};

enum class CommissioningPhase : std::uint8_t {
  idle,
  zero,        // bridge off: zeros of the current sensors
  guess,       // a first inductance, for the current loop
  align,       // the vector glides to the next direction
  resistance,  // direct currents
  inductance_d,
  inductance_q,
  solve,
  spin_align,
  ramp,        // turned open-loop
  speed_held,  // … at one speed
  accelerate,
  coast,
  finished,  // see `end`
};

// How it ended. From `resistance_range` on: a result that cannot be, refused; nothing of it may be used.
enum class CommissioningEnd : std::uint8_t {
  none,  // not yet
  done,
  cancelled,      // an order `off`
  order_expired,  // no fresh order
  parameters,     // entered ones that this board cannot serve
  current_sensor,
  overcurrent,
  overvoltage,
  undervoltage,
  overtemperature,
  no_current,     // full voltage drives no current: a phase is open or the inductance above what can be measured
  does_not_turn,  // the rotor does not follow the turned vector
  observer_lost,
  resistance_range,
  inductance_range,
  inductance_ratio_range,
  dead_time_range,
  flux_range,
  inertia_range,
  load_range,
  runs_differ_resistance,  // two runs apart by more than 5 %
  runs_differ_inductance,
  runs_differ_flux,
  runs_differ_inertia,
  speed_constant_differs,      // K_v · flux · pole pairs inconsistent by more than 15 %: most often wrong pole pairs
  counted_speed_inconsistent,  // no whole number of pole pairs within 5 %
  inertia_below_bell,
  inertia_far_above_bell,  // 10 x
};

// SI. Zero where not measured.
struct CommissioningResult {
  std::uint32_t number = 0;  // of the commissioning since power-up, from 1
  CommissioningPhase phase = CommissioningPhase::idle;
  CommissioningEnd end = CommissioningEnd::none;
  float progress = 0.0f;                               // 0..1
  bool standstill_valid = false;                       // the next six were measured and kept to their checks, however it ended
  bool spin_valid = false;                             // and these after them
  float resistance_ohm = 0.0f;                         // one phase and its switches, at temperature_K
  float inductance_d_H = 0.0f, inductance_q_H = 0.0f;  // small-signal, at 0 A
  float dead_time_s = 0.0f;                            // effective; bridge_loss_V() has the curve
  float dead_time_knee_A = 0.0f;                       // current that moves a switch node within half the dead time
  std::array<float, 3> zero_counts{};
  float temperature_K = 0.0f;  // board, at the start: the winding's too when the motor is cold
  float flux_linkage_Wb = 0.0f;
  float inertia_kg_m2 = 0.0f;  // bell and what is on it
  float friction_N_m = 0.0f;
  float load_N_m_s2 = 0.0f;                           // propeller torque / speed²; about 0 without one
  float held_e_rad_s = 0.0f;                          // electrical speed while `speed_held`
  std::uint8_t pole_pairs = 0;                        // measured against a counted speed; 0: not measured, left as entered
  SeenDirection direction = SeenDirection::not_seen;  // not_seen: not measured
};

// Volts that a leg loses at this current, against its sign: dead time and diodes, less what the charge of the switch node gives back:
// with a the knee, lost (1 - a/i) once the current is across within the dead time (2 a), linear below.
constexpr float bridge_loss_V(const CommissioningResult& r, float pwm_Hz, float diode_drop_V, float bus_V, float current_A) {
  const float lost_V = r.dead_time_s * pwm_Hz * (bus_V + 2.0f * diode_drop_V), a = r.dead_time_knee_A;
  const float size = __builtin_fabsf(current_A), sign = current_A < 0.0f ? -1.0f : current_A > 0.0f ? 1.0f : 0.0f;
  return sign * lost_V * (size >= 2.0f * a && size > 0.0f ? 1.0f - a / size : a > 0.0f ? 0.25f * size / a : 1.0f);
}

// What of a valid result becomes parameters; the rest stays as entered. switch_ohm: the board's share of the resistance.
constexpr Parameters with_commissioning(Parameters p, const CommissioningResult& r, float switch_ohm) {
  if (r.end != CommissioningEnd::done) return p;
  if (r.standstill_valid) {
    p.resistance_ohm = r.resistance_ohm - switch_ohm;
    p.inductance_H = 0.5f * (r.inductance_d_H + r.inductance_q_H);
    p.inductance_ratio = r.inductance_q_H / r.inductance_d_H;
  }
  if (r.spin_valid) {
    p.flux_linkage_Wb = r.flux_linkage_Wb;
    p.inertia_kg_m2 = r.inertia_kg_m2;
    p.load_N_m_s2 = r.load_N_m_s2;
    if (r.pole_pairs > 0) p.pole_pairs = r.pole_pairs;
    if (r.direction == SeenDirection::reversed) p.dir_reversed = !p.dir_reversed;
  }
  return p;
}

}  // namespace rotorloop::firmware
