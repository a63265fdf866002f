// The true motor: a permanent-magnet synchronous machine on a shaft. Its states are the rotor-frame currents, stepped by the
// classical Runge-Kutta formula once per PWM period. The firmware's observer integrates stator flux in the stator frame from
// counted voltages instead: the two share neither states nor difference equations.
//
// Frames: electrical angle 0 puts the magnet flux on phase U's axis; alpha is that axis, beta 90 electrical degrees ahead.
// Amplitude-invariant transform (a phase peak of 1 A is a vector of 1 A), hence the 3/2 in power and torque.
//   Ld di_d/dt = v_d - R i_d + w_e Lq i_q            (Krause, Analysis of Electric Machinery, ch. 4)
//   Lq di_q/dt = v_q - R i_q - w_e (Ld i_d + flux)
//   T = 3/2 p (flux i_q + (Ld - Lq) i_d i_q),  J dw/dt = T - load - friction - cogging
#pragma once
#include "sim/drive/motor_equations.hpp"

namespace rotorloop::sim {

struct AxisInductance {
  double d = 15e-6;
  double q = 15e-6;
};

// The fields of a motors/NAME.toml file. Defaults: the reference drive (2300 kV, 14 poles; decision 0010 derives the flux).
struct MotorParameters {
  double resistance_ohm = 0.06;
  AxisInductance inductance_H{};
  double flux_linkage_Wb = 3.42e-4;  // per phase, peak
  int pole_pairs = 7;
  double inertia_kg_m2 = 5.0e-6;  // rotor and bell; the propeller adds its own
  double static_friction_N_m = 2e-3;
  double cogging_N_m = 1e-3;  // peak
  // Iron (saturation.hpp): above 0, the current at which the inductances have fallen half-way or so to their share at the end.
  double saturation_A = 0.0;
  double saturated_share = 1.0;
};

class Motor {
 public:
  // total_inertia: rotor, bell and propeller. initial_angle: mechanical.
  Motor(const MotorParameters& parameters, double total_inertia_kg_m2, double initial_angle_rad = 0.0);

  // One step at constant stator voltage. Returns the energy that entered the terminals [J].
  double step_driven(Vector2 v_V, double series_resistance_ohm, const ShaftLoad& load, double dt_s);
  // One step with all switches open: the diodes force the current against the full bus voltage until it is zero. Returns the
  // energy taken from the bus (negative: the winding's energy goes back). The line voltage is taken to stay below the bus.
  double step_open(double bus_V, const ShaftLoad& load, double dt_s);

  Vector2 current_A() const { return stator_current_A(state_); }
  double torque_N_m() const { return sim::torque_N_m(constants(0.0), state_.i_d_A, state_.i_q_A); }
  double magnetic_energy_J() const;
  double kinetic_energy_J() const { return 0.5 * inertia_kg_m2_ * state_.omega_rad_s * state_.omega_rad_s; }
  double cogging_N_m() const { return sim::cogging_N_m(constants(0.0), state_); }

  const MotorState& state() const { return state_; }
  MotorState& state() { return state_; }  // tests and initial conditions
  const MotorParameters& parameters() const { return parameters_; }
  MotorParameters& parameters() { return parameters_; }  // damage during a run: a demagnetised or hot motor
  double inertia_kg_m2() const { return inertia_kg_m2_; }
  void set_inertia_kg_m2(double inertia_kg_m2) { inertia_kg_m2_ = inertia_kg_m2; }  // a lost propeller, a held rotor
  void set_angle(double mechanical_rad);
  // For the equations, with what stands in series with the winding.
  MotorConstants<double> constants(double series_resistance_ohm) const {
    const MotorParameters& p = parameters_;
    return {static_cast<double>(p.pole_pairs),
            p.resistance_ohm + series_resistance_ohm,
            p.inductance_H.d,
            p.inductance_H.q,
            p.flux_linkage_Wb,
            inertia_kg_m2_,
            p.static_friction_N_m,
            p.cogging_N_m};
  }

 private:
  MotorParameters parameters_;
  double inertia_kg_m2_;
  MotorState state_;
};

}  // namespace rotorloop::sim
