// What a motor is like, from R, L, flux, inertia, pole pairs and supply: the quantities by which every constant of start, observer and
// speed loop scales. The shares were found on one motor (2306, 2300 rpm/V); a 3-inch and a 17-inch motor are the same motor in them.
#pragma once
#include <cmath>

#include "firmware/core/interface.hpp"
#include "firmware/core/motor/vector.hpp"

namespace rotorloop::firmware {

constexpr float kUndervoltagePerCell_V = 3.0f, kDeratingPerCell_V = 0.3f;

// Bridge off below.
constexpr float undervoltage_V(const Parameters& p) {
  return p.cells > 0 ? kUndervoltagePerCell_V * static_cast<float>(p.cells) : p.undervoltage_V;
}

struct MotorScale {
  float torque_constant_N_m_A = 0.0f;
  float start_A = 0.0f;                  // current vector of the start
  float swing_rad_s = 0.0f;              // of a rotor held by it, a pendulum: sqrt(p Kt I / J)
  float hand_over_e_rad_s = 0.0f;        // electrical speed at which the back-EMF is trusted
  float electromechanical_rad_s = 0.0f;  // of inductance against inertia: sqrt(Kt flux p / (J L)). Current through a wrong inductance
                                         // turns the observer; a speed loop far above this would close itself through that error
};

// offset_A: by which a zero calibrated a second ago may be wrong. zone_A: current below which its sign, and so the voltage lost to the
// dead time, is in doubt.
inline MotorScale motor_scale(const Parameters& p, float resistance_ohm, float offset_A, float zone_A) {
  MotorScale m;
  const float pole_pairs = static_cast<float>(p.pole_pairs);
  m.torque_constant_N_m_A = 1.5f * pole_pairs * p.flux_linkage_Wb;
  // 0.3 of the limit turns a propeller against cogging, and eight times the zone leaves every phase of an alignment outside it; no more
  // than half of the lowest bus is spent on resistance.
  const float limit_A = p.phase_current_limit_A, above_A = 8.0f * zone_A < 0.5f * limit_A ? 8.0f * zone_A : 0.5f * limit_A;
  const float by_limit_A = 0.3f * limit_A > above_A ? 0.3f * limit_A : above_A;
  const float by_supply_A = 0.5f * undervoltage_V(p) / (kRoot3 * resistance_ohm);
  m.start_A = by_supply_A > 0.0f && by_supply_A < by_limit_A ? by_supply_A : by_limit_A;
  const float torque_N_m = m.torque_constant_N_m_A * m.start_A;
  m.swing_rad_s = std::sqrt(pole_pairs * torque_N_m / p.inertia_kg_m2);
  m.electromechanical_rad_s = std::sqrt(m.torque_constant_N_m_A * p.flux_linkage_Wb * pole_pairs / (p.inertia_kg_m2 * p.inductance_H));
  // 0.3 V of back-EMF against 0.1 V of doubt (resistance, dead time), on a higher bus more; and several swings' worth of turning, so that
  // the ramp is slow against the swing, but never beyond an eighth of what the lowest bus can turn.
  const float volts = undervoltage_V(p) > 12.0f ? undervoltage_V(p) * (0.3f / 12.0f) : 0.3f;
  const float doubt_V = 1.5f * resistance_ohm * offset_A;
  const float by_emf = (volts > doubt_V ? volts : doubt_V) / p.flux_linkage_Wb, by_swing = 3.0f * m.swing_rad_s;
  const float fastest = (undervoltage_V(p) > 6.0f ? undervoltage_V(p) : 6.0f) / (kRoot3 * p.flux_linkage_Wb);
  const float turning = by_swing < 0.125f * fastest ? by_swing : 0.125f * fastest;
  m.hand_over_e_rad_s = by_emf > turning ? by_emf : turning;
  return m;
}

}  // namespace rotorloop::firmware
