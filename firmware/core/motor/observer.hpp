// Where the rotor is, from voltages given and currents measured: stator flux by integration, minus L i, is the magnet's flux
// vector. The integral is exact for held voltages, so it holds to 200 keRPM (50 electrical degrees per period); a pull of the
// vector's length towards the known flux removes offsets (after Lee, Hong, Nam, Ortega, Praly, Astolfi 2010). A phase-locked
// loop gives the angle; a mechanical model corrected by it gives the speed.
#pragma once
#include "firmware/core/motor/motor_scale.hpp"
#include "firmware/core/motor/vector.hpp"

namespace rotorloop::firmware {

struct ObserverConfig {
  float period_s = 0.0f;
  float resistance_ohm = 0.0f;  // motor phase and switch; start value of the state's
  float inductance_H = 0.0f;
  float flux_linkage_Wb = 0.0f;
  float over_flux = 0.0f, over_period = 0.0f;
  float pull_share = 0.3f;                                // length correction rate as a share of electrical speed …
  float pull_min_rad_s = 0.0f, pull_max_rad_s = 1500.0f;  // … within these; the lower one is the rate at the hand-over
  // What the pull has to give in the same direction of the stator all the time is no motion but a voltage that is not there: the zero of a
  // current sensor that drifted, times resistance and dead time. It is learned at this share of the electrical speed.
  float offset_share = 0.007f, offset_most_V = 0.0f;
  // The length pulled to follows the one seen while running: a magnet weaker than the parameter by 30 % would turn the pull into
  // a push (its mean effect on an offset is pull·(1 - 2 (true/assumed)²)).
  float length_rate_rad_s = 60.0f, length_least = 0.55f, length_most = 1.45f;
  // Natural frequency of the phase-locked loop, damping 1: wide to pull in from any speed, narrower while running, where a
  // wide one couples an inductance error (40 A · 3 uH = a third of the magnet's flux) back into the current loop.
  float pll_search_rad_s = 1500.0f, pll_run_rad_s = 1000.0f;
  float search_rate = 0.0f;  // while searching: pull towards the turn from one vector to the next, per period (catches any speed)
  // Speed for the RPM loop: the torque that acts is known, so the angle's derivative only has to correct a mechanical model.
  // The corner must be low: resistance and inductance errors turn torque current into apparent rotation (0.01 rad/A at 20 %
  // of L), which would close a fast loop through the speed controller.
  float speed_corner_rad_s = 0.0f, unknown_share = 0.125f;  // unknown torque: second integral, share of corner²
  float lock_rate = 0.0f;                                   // filter of the lock indicator, per period
  float max_omega_e_rad_s = 0.0f;                           // a little above the usable speed
  float unknown_most_rad_s2 = 0.0f;                         // what the current limit can give, or the whole propeller at full speed
};

struct ObserverState {
  Stator stator_flux_Wb{};
  Stator last_current_A{};
  Stator magnet_flux_Wb{};
  Stator offset_V{};
  float length_Wb = 0.0f;  // that the magnet's vector is pulled to; 0: not yet set
  Angle angle{};
  float omega_e_rad_s = 0.0f;
  float speed_e_rad_s = 0.0f;   // for the RPM loop, electrical
  float unknown_rad_s2 = 0.0f;  // electrical acceleration not explained by the torque fed forward
  float lock = 0.0f;            // mean cosine of the angle error: 1 locked, 0 lost
  float flux_ratio = 0.0f;      // |magnet flux| / expected, filtered
};

// resistance_ohm: phase and switch, as measured and followed (resistance.hpp). modelled: torque_rad_s2 is meaningful.
// applied_V acted over the period that ended with current_A; torque_rad_s2: electrical acceleration that the known torque gives.
inline void step(const ObserverConfig& c, ObserverState& s, Stator applied_V, Stator current_A, float resistance_ohm, float torque_rad_s2,
                 bool modelled) {
  const Stator mean_A = 0.5f * (current_A + s.last_current_A);
  s.last_current_A = current_A;
  const float speed = magnitude(s.omega_e_rad_s);
  const float pull = clamp(c.pull_share * speed, c.pull_min_rad_s, c.pull_max_rad_s);
  s.stator_flux_Wb = s.stator_flux_Wb + c.period_s * (applied_V - resistance_ohm * mean_A + s.offset_V);
  Stator magnet = s.stator_flux_Wb - c.inductance_H * current_A;
  const float over_length = 1.0f / (s.length_Wb > 0.0f ? s.length_Wb : c.flux_linkage_Wb);
  const float ratio2 = (magnet.a * magnet.a + magnet.b * magnet.b) * over_length * over_length;
  // Bounded: far outside the circle the cubic pull would overshoot.
  const float correction = c.period_s * pull * clamp(1.0f - ratio2, -2.0f, 1.0f);
  const Stator before = s.magnet_flux_Wb;
  s.stator_flux_Wb = s.stator_flux_Wb + correction * magnet;
  magnet = magnet + correction * magnet;
  s.magnet_flux_Wb = magnet;
  const float learn = c.offset_share * speed * correction;
  s.offset_V = {clamp(s.offset_V.a + learn * magnet.a, -c.offset_most_V, c.offset_most_V),
                clamp(s.offset_V.b + learn * magnet.b, -c.offset_most_V, c.offset_most_V)};

  // Phase-locked loop.
  s.angle = s.angle + Angle::from_rad(s.omega_e_rad_s * c.period_s);
  const Rotation at = rotation(s.angle);
  const float size = length(magnet);
  s.length_Wb = modelled ? clamp(s.length_Wb + c.period_s * c.length_rate_rad_s * (size - s.length_Wb), c.length_least * c.flux_linkage_Wb,
                                 c.length_most * c.flux_linkage_Wb)
                         : c.flux_linkage_Wb;
  const float over_size = 1.0f / (size > 0.2f * c.flux_linkage_Wb ? size : 0.2f * c.flux_linkage_Wb);
  const float cross = (at.cos * magnet.b - at.sin * magnet.a) * over_size, dot = (at.cos * magnet.a + at.sin * magnet.b) * over_size;
  // Beyond a right angle the sine falls again: full correction, unless there is no vector to speak of.
  float error = cross;
  if (!(dot > 0.0f)) error = cross > 0.0f ? size * over_size : cross < 0.0f ? -size * over_size : 0.0f;
  const float wn = modelled ? c.pll_run_rad_s : c.pll_search_rad_s;
  s.angle = s.angle + Angle::from_rad(2.0f * wn * c.period_s * error);
  s.omega_e_rad_s = clamp(s.omega_e_rad_s + c.period_s * wn * wn * error, -c.max_omega_e_rad_s, c.max_omega_e_rad_s);

  if (!modelled) {
    const float turn = (before.a * magnet.b - before.b * magnet.a) * over_size * over_size * c.over_period;
    s.omega_e_rad_s += c.search_rate * (clamp(turn, -c.max_omega_e_rad_s, c.max_omega_e_rad_s) - s.omega_e_rad_s);
  }

  // Model and correction; without a model it follows the loop.
  const float turned_rad_s = s.omega_e_rad_s + 2.0f * wn * error;  // derivative of the tracked angle: no lag, noisy
  const float innovation = turned_rad_s - s.speed_e_rad_s;
  const float corner = c.speed_corner_rad_s;
  s.unknown_rad_s2 = modelled ? clamp(s.unknown_rad_s2 + c.period_s * c.unknown_share * corner * corner * innovation,
                                      -c.unknown_most_rad_s2, c.unknown_most_rad_s2)
                              : 0.0f;
  s.speed_e_rad_s = modelled ? s.speed_e_rad_s + c.period_s * (corner * innovation + torque_rad_s2 + s.unknown_rad_s2) : s.omega_e_rad_s;
  s.lock += c.lock_rate * (dot - s.lock);
  s.flux_ratio += c.lock_rate * (size * c.over_flux - s.flux_ratio);
}

// Tuned on the simulated drive, 2026-11-23 where no other date stands (pull, length and loops above 2026-11-21); docs/decisions/0012 has
// the reasons.
constexpr float kInductanceRatio = 1.0f;  // of outrunners when it is not known: 1.0 to 1.4
// With the inductance across the magnet what is left of the flux points along the magnet, whatever the one along it. A little less than
// the one at small currents: iron saturates. Of 900 drawn 5-inch motors 883 fly without a trip, 872 with all of it; 2026-11-26.
constexpr float kSaturatedInductance = 0.96f;
constexpr float kPullAtHandOver = 0.28f, kMostPullAtHandOver_rad_s = 1000.0f;  // of the hand-over's electrical speed
constexpr float kSearchRate_1_s = 480.0f;                                      // of the search and of the lock indicator: 2 ms
constexpr float kMostTurn_rad = 1.08f;                                         // in a sample; the usable speed turns 0.9

// speed_corner_rad_s: part of the RPM loop's tuning (speed_loop.hpp).
constexpr void configure_observer(const Parameters& p, const MotorScale& m, float resistance_ohm, float period_s, float speed_corner_rad_s,
                                  ObserverConfig& o) {
  o.period_s = period_s;
  o.over_period = 1.0f / period_s;
  o.resistance_ohm = resistance_ohm;
  const float ratio = p.inductance_ratio > 0.0f ? p.inductance_ratio : kInductanceRatio;
  o.inductance_H = kSaturatedInductance * p.inductance_H * 2.0f * ratio / (1.0f + ratio);
  o.flux_linkage_Wb = p.flux_linkage_Wb;
  o.over_flux = 1.0f / p.flux_linkage_Wb;
  const float pull_rad_s = kPullAtHandOver * m.hand_over_e_rad_s;
  o.pull_min_rad_s = pull_rad_s < kMostPullAtHandOver_rad_s ? pull_rad_s : kMostPullAtHandOver_rad_s;
  o.offset_most_V = p.flux_linkage_Wb * m.hand_over_e_rad_s;
  o.search_rate = o.lock_rate = kSearchRate_1_s * period_s;
  o.max_omega_e_rad_s = kMostTurn_rad / period_s;
  o.speed_corner_rad_s = speed_corner_rad_s;
  const float full_A = p.phase_current_limit_A, w = p.max_speed_rad_s, pole_pairs = static_cast<float>(p.pole_pairs);
  o.unknown_most_rad_s2 = pole_pairs / p.inertia_kg_m2 * (m.torque_constant_N_m_A * full_A + p.load_N_m_s2 * w * w);
}

}  // namespace rotorloop::firmware
