// The motor's differential equations and their step, written once for a single motor (Real = double) and for four side by side
// (Real = Lanes, sim/drive/lanes.hpp). See motor.hpp for frames and sources.
#pragma once
#include "sim/drive/lanes.hpp"

namespace rotorloop::sim {

template <class Real>
struct BasicVector2 {
  Real alpha = 0.0;
  Real beta = 0.0;
};
using Vector2 = BasicVector2<double>;

template <class Real>
struct BasicMotorState {
  Real i_d_A = 0.0;
  Real i_q_A = 0.0;
  Real omega_rad_s = 0.0;  // mechanical, signed
  Real angle_rad = 0.0;    // mechanical, accumulated from the start
  Real cos_e = 1.0;        // of the electrical angle; kept by rotation, not by a libm call
  Real sin_e = 0.0;
};
using MotorState = BasicMotorState<double>;

// Resisting torque of the propeller, T = coefficient·w|w| + constant against the rotation.
template <class Real>
struct BasicShaftLoad {
  Real quadratic_N_m_s2 = 0.0;
  Real constant_N_m = 0.0;  // opposes rotation like friction; also holds a locked rotor in tests
};
using ShaftLoad = BasicShaftLoad<double>;

// What the equations need of a motor and its shaft.
template <class Real>
struct MotorConstants {
  Real pole_pairs;
  Real resistance_ohm;
  Real inductance_d_H, inductance_q_H;
  Real flux_linkage_Wb;
  Real inertia_kg_m2;
  Real static_friction_N_m, cogging_N_m;
};

template <class Real>
struct BasicRotation {
  Real cos, sin;
};

// Rotation by a small angle; below 0.5 rad (200 keRPM turns 0.44 rad per PWM period) the first omitted terms are < 6e-9.
template <class Real>
inline BasicRotation<Real> small_rotation(const Real& a) {
  const Real z = a * a;
  return {1.0 - z * (0.5 - z * (1.0 / 24 - z * (1.0 / 720 - z / 40320.0))),
          a * (1.0 - z * (1.0 / 6 - z * (1.0 / 120 - z * (1.0 / 5040 - z / 362880.0))))};
}

template <class Real>
inline BasicRotation<Real> rotate(const BasicRotation<Real>& r, const BasicRotation<Real>& by) {
  return {r.cos * by.cos - r.sin * by.sin, r.sin * by.cos + r.cos * by.sin};
}

// Speed over which dry friction turns its sign. Far below any speed that matters, far above what a 21 us step needs.
inline constexpr double kFrictionKnee_rad_s = 1.0;

template <class Real>
inline Real knee_speed_rad_s(const Real& w) {
  return square_root(w * w + kFrictionKnee_rad_s * kFrictionKnee_rad_s);
}

template <class Real>
inline Real friction_N_m(const MotorConstants<Real>& m, const BasicMotorState<Real>& s) {
  return m.static_friction_N_m * s.omega_rad_s / knee_speed_rad_s(s.omega_rad_s);
}

// 12 slots and 14 poles repeat 84 times per turn, which is 12 times per electrical turn: sin(12 x) from sin x, cos x.
template <class Real>
inline Real cogging_N_m(const MotorConstants<Real>& m, const BasicMotorState<Real>& s) {
  const Real s2 = 2.0 * s.sin_e * s.cos_e, c2 = 1.0 - 2.0 * s.sin_e * s.sin_e;
  const Real s4 = 2.0 * s2 * c2;
  return m.cogging_N_m * s4 * (3.0 - 4.0 * s4 * s4);
}

template <class Real>
inline Real load_N_m(const BasicShaftLoad<Real>& load, const BasicMotorState<Real>& s) {
  const Real& w = s.omega_rad_s;
  return load.quadratic_N_m_s2 * w * magnitude(w) + load.constant_N_m * (w / knee_speed_rad_s(w));
}

template <class Real>
inline Real torque_N_m(const MotorConstants<Real>& m, const Real& i_d_A, const Real& i_q_A) {
  return 1.5 * m.pole_pairs * (m.flux_linkage_Wb * i_q_A + (m.inductance_d_H - m.inductance_q_H) * i_d_A * i_q_A);
}

template <class Real>
inline BasicVector2<Real> stator_current_A(const BasicMotorState<Real>& s) {
  return {s.cos_e * s.i_d_A - s.sin_e * s.i_q_A, s.sin_e * s.i_d_A + s.cos_e * s.i_q_A};
}

template <class Real>
inline void advance_angle(const MotorConstants<Real>& m, BasicMotorState<Real>& s, const Real& omega_before_rad_s, const Real& dt_s) {
  const Real turned = 0.5 * (omega_before_rad_s + s.omega_rad_s) * dt_s;
  s.angle_rad += turned;
  const BasicRotation<Real> r = rotate<Real>({s.cos_e, s.sin_e}, small_rotation(Real(turned * m.pole_pairs)));
  const Real norm = 1.5 - 0.5 * (r.cos * r.cos + r.sin * r.sin);  // Newton step towards length 1
  s.cos_e = r.cos * norm;
  s.sin_e = r.sin * norm;
}

// What a change of current meets; differs from the constants' (flux over current) where iron saturates.
template <class Real>
struct TransientInductance {
  Real d_H, q_H;
};

// One classical Runge-Kutta step at constant stator voltage; m.resistance_ohm with what is in series. Returns the energy that
// entered behind the voltage [J].
template <class Real>
inline Real driven_step(const MotorConstants<Real>& m, BasicMotorState<Real>& s, const BasicVector2<Real>& v_V,
                        const BasicShaftLoad<Real>& load, const Real& dt_s, const TransientInductance<Real>& transient) {
  using Rotation = BasicRotation<Real>;
  const Real over_ld = 1.0 / transient.d_H, over_lq = 1.0 / transient.q_H, over_j = 1.0 / m.inertia_kg_m2;
  const Real w0 = s.omega_rad_s;
  // Friction, cogging and load change little over 21 us: taken once per step.
  const Real resisting_N_m = load_N_m(load, s) + friction_N_m(m, s) + cogging_N_m(m, s);

  // The voltage stands still in the stator, so it turns backwards in the rotor frame: its components at start, middle, end.
  const Rotation start{s.cos_e, s.sin_e};
  const Rotation half = small_rotation(Real(0.5 * w0 * m.pole_pairs * dt_s));
  const Rotation middle = rotate(start, half), end = rotate(middle, half);
  struct Derivative {
    Real d, q, w, energy;
  };
  const auto slope = [&](const Real& i_d, const Real& i_q, const Real& w, const Rotation& at) -> Derivative {
    const Real v_d = at.cos * v_V.alpha + at.sin * v_V.beta, v_q = at.cos * v_V.beta - at.sin * v_V.alpha;
    const Real w_e = w * m.pole_pairs;
    return {(v_d - m.resistance_ohm * i_d + w_e * m.inductance_q_H * i_q) * over_ld,
            (v_q - m.resistance_ohm * i_q - w_e * (m.inductance_d_H * i_d + m.flux_linkage_Wb)) * over_lq,
            (torque_N_m(m, i_d, i_q) - resisting_N_m) * over_j, 1.5 * (v_d * i_d + v_q * i_q)};
  };
  const Real i_d = s.i_d_A, i_q = s.i_q_A, h = 0.5 * dt_s;
  const Derivative k1 = slope(i_d, i_q, w0, start);
  const Derivative k2 = slope(i_d + h * k1.d, i_q + h * k1.q, w0 + h * k1.w, middle);
  const Derivative k3 = slope(i_d + h * k2.d, i_q + h * k2.q, w0 + h * k2.w, middle);
  const Derivative k4 = slope(i_d + dt_s * k3.d, i_q + dt_s * k3.q, w0 + dt_s * k3.w, end);
  const Real sixth = dt_s / 6.0;
  s.i_d_A += sixth * (k1.d + 2.0 * (k2.d + k3.d) + k4.d);
  s.i_q_A += sixth * (k1.q + 2.0 * (k2.q + k3.q) + k4.q);
  s.omega_rad_s += sixth * (k1.w + 2.0 * (k2.w + k3.w) + k4.w);
  advance_angle(m, s, w0, dt_s);
  return sixth * (k1.energy + 2.0 * (k2.energy + k3.energy) + k4.energy);
}

template <class Real>
inline Real driven_step(const MotorConstants<Real>& m, BasicMotorState<Real>& s, const BasicVector2<Real>& v_V,
                        const BasicShaftLoad<Real>& load, const Real& dt_s) {
  return driven_step(m, s, v_V, load, dt_s, {m.inductance_d_H, m.inductance_q_H});
}

}  // namespace rotorloop::sim
