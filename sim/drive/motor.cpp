#include "sim/drive/motor.hpp"

#include "host/base/elementary.hpp"

namespace rotorloop::sim {
namespace {

// Speed over which dry friction turns its sign. Far below any speed that matters, far above what a 21 us step needs.
constexpr double kFrictionKnee_rad_s = 1.0;

struct Rotation {
  double cos, sin;
};

// Rotation by a small angle; below 0.5 rad (200 keRPM turns 0.44 rad per PWM period) the first omitted terms are < 6e-9.
Rotation small_rotation(double a) {
  const double z = a * a;
  return {1.0 - z * (0.5 - z * (1.0 / 24 - z * (1.0 / 720 - z / 40320.0))),
          a * (1.0 - z * (1.0 / 6 - z * (1.0 / 120 - z * (1.0 / 5040 - z / 362880.0))))};
}

Rotation rotate(Rotation r, Rotation by) { return {r.cos * by.cos - r.sin * by.sin, r.sin * by.cos + r.cos * by.sin}; }

}  // namespace

Motor::Motor(const MotorParameters& parameters, double total_inertia_kg_m2, double initial_angle_rad)
    : parameters_(parameters), inertia_kg_m2_(total_inertia_kg_m2) {
  set_angle(initial_angle_rad);
}

void Motor::set_angle(double mechanical_rad) {
  state_.angle_rad = mechanical_rad;
  const SinCos e = sincos_exact(mechanical_rad * parameters_.pole_pairs);
  state_.cos_e = e.cos;
  state_.sin_e = e.sin;
}

double Motor::magnetic_energy_J() const {
  return 0.75 * (parameters_.inductance_H.d * state_.i_d_A * state_.i_d_A + parameters_.inductance_H.q * state_.i_q_A * state_.i_q_A);
}

double Motor::friction_N_m() const {
  const double w = state_.omega_rad_s;
  return parameters_.static_friction_N_m * w / std::sqrt(w * w + kFrictionKnee_rad_s * kFrictionKnee_rad_s);
}

// 12 slots and 14 poles repeat 84 times per turn, which is 12 times per electrical turn: sin(12 x) from sin x, cos x.
double Motor::cogging_N_m() const {
  const double s2 = 2.0 * state_.sin_e * state_.cos_e, c2 = 1.0 - 2.0 * state_.sin_e * state_.sin_e;
  const double s4 = 2.0 * s2 * c2;
  return parameters_.cogging_N_m * s4 * (3.0 - 4.0 * s4 * s4);
}

double Motor::load_N_m(const ShaftLoad& load) const {
  const double w = state_.omega_rad_s;
  const double direction = w / std::sqrt(w * w + kFrictionKnee_rad_s * kFrictionKnee_rad_s);
  return load.quadratic_N_m_s2 * w * std::fabs(w) + load.constant_N_m * direction;
}

void Motor::advance_angle(double omega_before_rad_s, double dt_s) {
  const double turned = 0.5 * (omega_before_rad_s + state_.omega_rad_s) * dt_s;
  state_.angle_rad += turned;
  const Rotation r = rotate({state_.cos_e, state_.sin_e}, small_rotation(turned * parameters_.pole_pairs));
  const double norm = 1.5 - 0.5 * (r.cos * r.cos + r.sin * r.sin);  // Newton step towards length 1
  state_.cos_e = r.cos * norm;
  state_.sin_e = r.sin * norm;
}

double Motor::step_driven(Vector2 v_V, double series_resistance_ohm, const ShaftLoad& load, double dt_s) {
  const MotorParameters& m = parameters_;
  const double p = m.pole_pairs, r_ohm = m.resistance_ohm + series_resistance_ohm;
  const double over_ld = 1.0 / m.inductance_H.d, over_lq = 1.0 / m.inductance_H.q, over_j = 1.0 / inertia_kg_m2_;
  const double w0 = state_.omega_rad_s;
  // Friction, cogging and load change little over 21 us: taken once per step.
  const double resisting_N_m = load_N_m(load) + friction_N_m() + cogging_N_m();

  // The voltage stands still in the stator, so it turns backwards in the rotor frame: its components at start, middle, end.
  const Rotation start{state_.cos_e, state_.sin_e};
  const Rotation half = small_rotation(0.5 * w0 * p * dt_s);
  const Rotation middle = rotate(start, half), end = rotate(middle, half);
  struct Derivative {
    double d, q, w, energy;
  };
  const auto slope = [&](double i_d, double i_q, double w, Rotation at) -> Derivative {
    const double v_d = at.cos * v_V.alpha + at.sin * v_V.beta, v_q = at.cos * v_V.beta - at.sin * v_V.alpha;
    const double w_e = w * p;
    return {(v_d - r_ohm * i_d + w_e * m.inductance_H.q * i_q) * over_ld,
            (v_q - r_ohm * i_q - w_e * (m.inductance_H.d * i_d + m.flux_linkage_Wb)) * over_lq, (torque(i_d, i_q) - resisting_N_m) * over_j,
            1.5 * (v_d * i_d + v_q * i_q)};
  };
  const double i_d = state_.i_d_A, i_q = state_.i_q_A, h = 0.5 * dt_s;
  const Derivative k1 = slope(i_d, i_q, w0, start);
  const Derivative k2 = slope(i_d + h * k1.d, i_q + h * k1.q, w0 + h * k1.w, middle);
  const Derivative k3 = slope(i_d + h * k2.d, i_q + h * k2.q, w0 + h * k2.w, middle);
  const Derivative k4 = slope(i_d + dt_s * k3.d, i_q + dt_s * k3.q, w0 + dt_s * k3.w, end);
  const double sixth = dt_s / 6.0;
  state_.i_d_A += sixth * (k1.d + 2.0 * (k2.d + k3.d) + k4.d);
  state_.i_q_A += sixth * (k1.q + 2.0 * (k2.q + k3.q) + k4.q);
  state_.omega_rad_s += sixth * (k1.w + 2.0 * (k2.w + k3.w) + k4.w);
  advance_angle(w0, dt_s);
  return sixth * (k1.energy + 2.0 * (k2.energy + k3.energy) + k4.energy);
}

double Motor::step_open(double bus_V, const ShaftLoad& load, double dt_s) {
  // With three diodes conducting the stator vector opposing the current has length 2/3 bus (a switching state's length).
  const double magnitude = std::sqrt(state_.i_d_A * state_.i_d_A + state_.i_q_A * state_.i_q_A);
  const double w0 = state_.omega_rad_s;
  const double torque_before = torque_N_m();
  double returned_J = 0.0;
  if (magnitude > 0.0) {
    const double l_mean = 0.5 * (parameters_.inductance_H.d + parameters_.inductance_H.q);
    const double reverse_V = 2.0 / 3.0 * bus_V;
    const double left = std::fmax(0.0, magnitude - reverse_V / l_mean * dt_s);
    const double conducting_s = (magnitude - left) * l_mean / reverse_V;
    returned_J = 1.5 * reverse_V * 0.5 * (magnitude + left) * conducting_s;
    state_.i_d_A *= left / magnitude;
    state_.i_q_A *= left / magnitude;
  }
  const double torque_mean = 0.5 * (torque_before + torque_N_m());
  state_.omega_rad_s += (torque_mean - load_N_m(load) - friction_N_m() - cogging_N_m()) / inertia_kg_m2_ * dt_s;
  advance_angle(w0, dt_s);
  return -returned_J;
}

}  // namespace rotorloop::sim
