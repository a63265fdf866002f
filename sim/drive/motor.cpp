#include "sim/drive/motor.hpp"

#include "host/base/elementary.hpp"
#include "sim/drive/saturation.hpp"

namespace rotorloop::sim {

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
  if (const MotorParameters& p = parameters_; p.saturation_A > 0.0)
    return 1.5 * (axis_energy_J(p.inductance_H.d, p.saturated_share, p.saturation_A, state_.i_d_A) +
                  axis_energy_J(p.inductance_H.q, p.saturated_share, p.saturation_A, state_.i_q_A));
  return 0.75 * (parameters_.inductance_H.d * state_.i_d_A * state_.i_d_A + parameters_.inductance_H.q * state_.i_q_A * state_.i_q_A);
}

double Motor::step_driven(Vector2 v_V, double series_resistance_ohm, const ShaftLoad& load, double dt_s) {
  return driven_step(constants(series_resistance_ohm), state_, v_V, load, dt_s);
}

double Motor::step_open(double bus_V, const ShaftLoad& load, double dt_s) {
  const MotorConstants<double> m = constants(0.0);
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
  state_.omega_rad_s +=
      (torque_mean - load_N_m(load, state_) - friction_N_m(m, state_) - sim::cogging_N_m(m, state_)) / inertia_kg_m2_ * dt_s;
  advance_angle(m, state_, w0, dt_s);
  return -returned_J;
}

}  // namespace rotorloop::sim
