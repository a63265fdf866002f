// How a half bridge really changes sides, averaged over one PWM period. During the dead time nobody holds the switch node: the
// phase current moves it, charging the output capacitances of both FETs. A large current is across at once and then flows
// through a body diode; a small one does not arrive before the other FET switches. The current at an edge is not the mean one:
// the ripple of the period, known from the three duties, is added where the node falls and taken off where it rises.
//
// With C the capacitance of the node, U the supply, t_d the effective dead time, L the inductance and x the current out of the leg
// at the edge: volt-seconds gained where the node should fall at once (diode drop U_D)
//   x >= x_r: U t_d x_c / (2 x) - U_D t_d (1 - x_c / x)      x_c = C U / t_d: the node is across after t_d x_c / x, then the diode
//   0..x_r:   linear between                                 x_r = max(x_c, 0.3 U t_d / L)
//   < 0:      U t_d + U_D t_d min(1, -x / x_r)               the high diode holds it
// and the mirror image where it should rise. Below U t_d / L (0.8 A for 15 V, 800 ns, 15 uH) the dead time itself moves the current
// while it lasts; 0.3 of it was read off the bridge that steps every edge (switched_bridge.hpp), which also says how far this law is
// right (test switched_bridge_test).
#pragma once
#include <array>

#include "sim/drive/inverter.hpp"

namespace rotorloop::sim {

template <class Real>
struct CommutationConstants {
  Real dead_share;  // effective dead time over the period
  Real diode_drop_V;
  Real bus_V;
  Real per_reach_A;  // 1 / x_r
  Real reach_left;   // x_c / (2 x_r): share of U t_d that is still gained there
  std::array<Real, 3> half_ripple_A;
  std::array<Real, 3> switches;  // 1; 0 for a leg that stays on one side for the whole period
};

template <class Real>
inline CommutationConstants<Real> commutation_constants(const Real& dead_time_s, const Real& pwm_Hz, const Real& diode_drop_V,
                                                        const Real& bus_V, const Real& node_F, const Real& inductance_H) {
  const Real corner_A = node_F * bus_V / dead_time_s, moved_A = 0.3 * bus_V * dead_time_s / inductance_H;
  const Real per_reach_A = 1.0 / if_at_least(corner_A, moved_A, corner_A, moved_A);
  return {dead_time_s * pwm_Hz, diode_drop_V, bus_V, per_reach_A, 0.5 * corner_A * per_reach_A, {}, {}};
}

// Half of the current's ripple of each phase, between the edges of that phase; exact for an inductance alone and a star point
// that floats, centre-aligned PWM. `duty_V_s_over_H`: bus voltage times period over inductance, A.
template <class Real>
inline std::array<Real, 3> half_ripple_A(const std::array<Real, 3>& duty, const Real& duty_V_s_over_H) {
  const Real zero = 0.0;
  const auto above = [&](const Real& a, const Real& b) { return if_at_least(a, b, Real(a - b), zero); };
  const Real mean = (duty[0] + duty[1] + duty[2]) * (1.0 / 3.0);
  std::array<Real, 3> r;
  for (std::size_t k = 0; k < 3; ++k) {
    const Real others = (above(duty[(k + 1) % 3], duty[k]) + above(duty[(k + 2) % 3], duty[k])) * (1.0 / 3.0);
    r[k] = 0.5 * duty_V_s_over_H * (others + (duty[k] - mean) * (1.0 - duty[k]));
  }
  return r;
}

// Volts over the period that a falling edge at x amperes adds; the diode's part apart, since it takes energy.
template <class Real>
struct EdgeVolts {
  Real node_V, diode_V;
};

template <class Real>
inline EdgeVolts<Real> edge_volts(const CommutationConstants<Real>& c, const Real& x_A) {
  const Real y = x_A * c.per_reach_A, one = 1.0, zero = 0.0;
  const Real beyond = c.reach_left / if_at_least(y, one, y, one);
  const Real below = if_at_least(y, zero, Real(1.0 - y * (1.0 - c.reach_left)), one);
  const Real node = if_at_least(y, one, beyond, below);
  const Real on_low = if_at_least(node, Real(0.5), zero, Real(2.0 * node - 1.0));
  const Real on_high = if_at_least(Real(-1.0), y, one, Real(zero - y));
  return {c.dead_share * c.bus_V * node, c.dead_share * c.diode_drop_V * if_at_least(y, zero, on_low, on_high)};
}

// Error of each leg against what the gates are told, volts over the period; the part of the diodes apart.
template <class Real>
inline std::array<EdgeVolts<Real>, 3> leg_errors(const CommutationConstants<Real>& c, const BasicPhaseCurrents<Real>& i) {
  const std::array<Real, 3> current = {i.u, i.v, i.w};
  std::array<EdgeVolts<Real>, 3> errors;
  for (std::size_t k = 0; k < 3; ++k) {
    const EdgeVolts<Real> fall = edge_volts(c, Real(c.half_ripple_A[k] + current[k]));
    const EdgeVolts<Real> rise = edge_volts(c, Real(c.half_ripple_A[k] - current[k]));
    errors[k] = {(fall.node_V - rise.node_V) * c.switches[k], (fall.diode_V - rise.diode_V) * c.switches[k]};
  }
  return errors;
}

// The ripple is that of the pulses which really come: what the dead time takes from them is found first, with the ripple of the
// pulses as told.
template <class Real>
inline void set_ripple(CommutationConstants<Real>& c, const std::array<Real, 3>& duty, const BasicPhaseCurrents<Real>& i,
                       const Real& duty_V_s_over_H) {
  c.half_ripple_A = half_ripple_A(duty, duty_V_s_over_H);
  const Real zero = 0.0, one = 1.0;
  for (std::size_t k = 0; k < 3; ++k) c.switches[k] = if_at_least(zero, duty[k], zero, if_at_least(duty[k], one, zero, one));
  const std::array<EdgeVolts<Real>, 3> errors = leg_errors(c, i);
  const Real per_V = 1.0 / c.bus_V;
  std::array<Real, 3> real;
  for (std::size_t k = 0; k < 3; ++k) real[k] = duty[k] + (errors[k].node_V + errors[k].diode_V) * per_V;
  c.half_ripple_A = half_ripple_A(real, duty_V_s_over_H);
}

// duty: high-side share of the period for U, V, W as the gates are told, 0..1.
template <class Real>
inline BasicBridgeOutput<Real> commutated_output(const CommutationConstants<Real>& c, const std::array<Real, 3>& duty,
                                                 const BasicPhaseCurrents<Real>& i) {
  const std::array<EdgeVolts<Real>, 3> errors = leg_errors(c, i);
  const std::array<Real, 3> current = {i.u, i.v, i.w};
  std::array<Real, 3> v;
  Real loss_W = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    v[k] = duty[k] * c.bus_V + errors[k].node_V + errors[k].diode_V;
    loss_W += -1.0 * errors[k].diode_V * current[k];
  }
  constexpr double kOverRoot3 = 0.57735026918962576451;
  return {{(2.0 * v[0] - v[1] - v[2]) / 3.0, (v[1] - v[2]) * kOverRoot3}, loss_W};
}

}  // namespace rotorloop::sim
