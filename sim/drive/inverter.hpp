// The true power stage, averaged over one PWM period: duty in, stator voltage out, with what the firmware has to fight:
// dead time and diode drops that take voltage against the sign of each phase current.
#pragma once
#include <array>

#include "sim/drive/motor.hpp"

namespace rotorloop::sim {

struct InverterParameters {
  double pwm_Hz = 48000.0;
  double dead_time_s = 800e-9;          // effective; ST's project for the B-G431B-ESC1 uses 750..800 ns
  double diode_drop_V = 0.8;            // body diode during the dead time; silicon at 20 A, typical
  double switch_resistance_ohm = 4e-3;  // FET about 2.4 mohm plus half the 3 mohm shunt (STL180N6F7, UM2516)
  // Around zero the switch node's charge and the ripple make the error proportional to current: half the ripple of about 3 A.
  double zero_zone_A = 1.5;
};

struct PhaseCurrents {
  double u = 0.0, v = 0.0, w = 0.0;
};

inline PhaseCurrents to_phases(Vector2 i) {
  constexpr double kHalfRoot3 = 0.86602540378443864676;
  return {i.alpha, -0.5 * i.alpha + kHalfRoot3 * i.beta, -0.5 * i.alpha - kHalfRoot3 * i.beta};
}

// Sign of a current, smooth (once differentiable) inside +-zone.
inline double soft_sign(double i_A, double zone_A) {
  const double x = i_A / zone_A;
  return x >= 1.0 ? 1.0 : x <= -1.0 ? -1.0 : 0.5 * x * (3.0 - x * x);
}

struct BridgeOutput {
  Vector2 v_V;  // at the motor terminals, before the resistance of the switches
  double diode_loss_W = 0.0;
};

// duty: high-side share of the period for U, V, W, 0..1.
inline BridgeOutput bridge_output(const InverterParameters& p, const std::array<double, 3>& duty, const PhaseCurrents& i, double bus_V) {
  const double dead = p.dead_time_s * p.pwm_Hz;  // share of the period
  const double lost_V = dead * (bus_V + 2.0 * p.diode_drop_V);
  const double su = soft_sign(i.u, p.zero_zone_A), sv = soft_sign(i.v, p.zero_zone_A), sw = soft_sign(i.w, p.zero_zone_A);
  const double u = duty[0] * bus_V - lost_V * su, v = duty[1] * bus_V - lost_V * sv, w = duty[2] * bus_V - lost_V * sw;
  constexpr double kOverRoot3 = 0.57735026918962576451;
  return {{(2.0 * u - v - w) / 3.0, (v - w) * kOverRoot3}, 2.0 * dead * p.diode_drop_V * (su * i.u + sv * i.v + sw * i.w)};
}

}  // namespace rotorloop::sim
