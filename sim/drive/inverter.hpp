// The true power stage, averaged over one PWM period: duty in, stator voltage out, with what the firmware has to fight:
// dead time and diode drops that take voltage against the sign of each phase current.
#pragma once
#include <array>

#include "sim/drive/motor_equations.hpp"

namespace rotorloop::sim {

struct InverterParameters {
  double pwm_Hz = 48000.0;
  double dead_time_s = 800e-9;          // effective; ST's project for the B-G431B-ESC1 uses 750..800 ns
  double diode_drop_V = 0.8;            // body diode during the dead time; silicon at 20 A, typical
  double switch_resistance_ohm = 4e-3;  // FET about 2.4 mohm plus half the 3 mohm shunt (STL180N6F7, UM2516)
  // Around zero the switch node's charge and the ripple make the error proportional to current: half the ripple of about 3 A.
  double zero_zone_A = 1.5;
  // Of one switch node: both FETs' output capacitance (charge-equivalent) and the wire. Above 0 the edges follow the charge of the
  // node and the true ripple (commutation.hpp), and zero_zone_A is not used.
  double node_capacitance_F = 0.0;
  double switching_s = 60e-9;  // overlap of voltage and current at a hard edge: heat of the FETs only
};

template <class Real>
struct BasicPhaseCurrents {
  Real u = 0.0, v = 0.0, w = 0.0;
};
using PhaseCurrents = BasicPhaseCurrents<double>;

template <class Real>
inline BasicPhaseCurrents<Real> to_phases(const BasicVector2<Real>& i) {
  constexpr double kHalfRoot3 = 0.86602540378443864676;
  return {i.alpha, -0.5 * i.alpha + kHalfRoot3 * i.beta, -0.5 * i.alpha - kHalfRoot3 * i.beta};
}

// Sign of a current, smooth (once differentiable) inside +-zone.
template <class Real>
inline Real soft_sign(const Real& i_A, const Real& zone_A) {
  const Real x = i_A / zone_A;
  return if_at_least(x, Real(1.0), Real(1.0), if_at_least(Real(-1.0), x, Real(-1.0), Real(0.5 * x * (3.0 - x * x))));
}

template <class Real>
struct BasicBridgeOutput {
  BasicVector2<Real> v_V;  // at the motor terminals, before the resistance of the switches
  Real diode_loss_W = 0.0;
};
using BridgeOutput = BasicBridgeOutput<double>;

// What the averaged bridge needs of its parameters and its supply.
template <class Real>
struct BridgeConstants {
  Real dead_share;  // of the period
  Real diode_drop_V;
  Real zero_zone_A;
  Real bus_V;
};

inline BridgeConstants<double> bridge_constants(const InverterParameters& p, double bus_V) {
  return {p.dead_time_s * p.pwm_Hz, p.diode_drop_V, p.zero_zone_A, bus_V};
}

// duty: high-side share of the period for U, V, W, 0..1.
template <class Real>
inline BasicBridgeOutput<Real> bridge_output(const BridgeConstants<Real>& p, const std::array<Real, 3>& duty,
                                             const BasicPhaseCurrents<Real>& i) {
  const Real lost_V = p.dead_share * (p.bus_V + 2.0 * p.diode_drop_V);
  // A leg that stays on one side for the whole period has no dead time: shorted windings brake with all that they induce.
  const auto lost_share = [&](const Real& d, const Real& i_A) {
    const Real zero(0.0), one(1.0);
    return if_at_least(zero, d, zero, if_at_least(d, one, zero, soft_sign(i_A, p.zero_zone_A)));
  };
  const Real su = lost_share(duty[0], i.u), sv = lost_share(duty[1], i.v), sw = lost_share(duty[2], i.w);
  const Real u = duty[0] * p.bus_V - lost_V * su, v = duty[1] * p.bus_V - lost_V * sv, w = duty[2] * p.bus_V - lost_V * sw;
  constexpr double kOverRoot3 = 0.57735026918962576451;
  return {{(2.0 * u - v - w) / 3.0, (v - w) * kOverRoot3}, 2.0 * p.dead_share * p.diode_drop_V * (su * i.u + sv * i.v + sw * i.w)};
}

}  // namespace rotorloop::sim
