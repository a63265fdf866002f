// Resistance while running: copper gains 0.39 % per kelvin and a winding heats in seconds, so the value of the last start ages.
// A wrong resistance makes the observer's magnet vector longer when driving and shorter when braking, by (R - R_assumed) i_q / w_e; a wrong
// flux makes it longer or shorter always. So only the changes of its length that come with changes of i_q / w_e teach (least mean
// squares): steady running teaches nothing, and the flux need not be known.
#pragma once
#include "firmware/core/motor/angle.hpp"
#include "firmware/core/motor/motor_scale.hpp"

namespace rotorloop::firmware {

// The assumed resistance, at a start and later, as shares of the parameter. Upwards room for copper 100 K hotter (1.39) in a motor 30 % off
// its data sheet: to refuse a hot winding is to run on exactly the error that the measurement is there for.
constexpr float kResistanceLeast = 0.65f, kResistanceMost = 1.8f;

struct ResistanceConfig {
  float least_ohm = 0.0f, most_ohm = 0.0f;
  float learn_ohm_A_s = 0.0f;        // per supervision tick, ohm per change of flux ratio and of i_q / w_e
  float mean = 0.0f;                 // per supervision tick: changes are those against the mean
  float least_change_A_s = 0.0f;     // of i_q / w_e: current noise, which stands in both factors, stays below
  float least_omega_e_rad_s = 0.0f;  // a back-EMF of 0.5 V: below, dead time outweighs resistance
};
struct ResistanceState {
  float flux_ratio = 0.0f, current_A_s = 0.0f;  // means: of the vector's length over the parameter; of i_q / w_e
};

// One supervision tick of the running motor; returns the resistance to use from now on.
constexpr float step(const ResistanceConfig& c, ResistanceState& s, float resistance_ohm, float flux_ratio, float current_q_A,
                     float omega_e_rad_s) {
  if (magnitude(omega_e_rad_s) < c.least_omega_e_rad_s) return resistance_ohm;
  const float change_A_s = current_q_A / omega_e_rad_s - s.current_A_s, change = flux_ratio - s.flux_ratio;
  s.current_A_s += c.mean * change_A_s;
  s.flux_ratio += c.mean * change;
  if (magnitude(change_A_s) < c.least_change_A_s) return resistance_ohm;
  return clamp(resistance_ohm + c.learn_ohm_A_s * change * change_A_s, c.least_ohm, c.most_ohm);
}

// Tuned on the simulated drive, 2026-11-23 (docs/decisions/0012, number 6).
constexpr float kResistanceLearn = 5.7f;  // a second at changes that move the flux ratio as 20 % of R at a third of the rated current does
constexpr float kResistanceMean_1_s = 20.0f;
constexpr float kResistanceChange = 0.187f;  // of flux over R
constexpr float kResistanceHandOver = 1.7f;  // of the hand-over's electrical speed

constexpr ResistanceConfig configure_resistance(const Parameters& p, const MotorScale& m, float resistance_ohm, float tick_s) {
  return {kResistanceLeast * resistance_ohm,
          kResistanceMost * resistance_ohm,
          kResistanceLearn * resistance_ohm * resistance_ohm * tick_s / p.flux_linkage_Wb,
          kResistanceMean_1_s * tick_s,
          kResistanceChange * p.flux_linkage_Wb / resistance_ohm,
          kResistanceHandOver * m.hand_over_e_rad_s};
}

}  // namespace rotorloop::firmware
