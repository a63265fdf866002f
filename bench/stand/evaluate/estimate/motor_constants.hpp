// Motor constants from steady steps of a run: with a sine drive (field-oriented, no current along the flux) of duty d on the bus voltage V
//   line-to-line voltage amplitude  U = d V,  phase amplitude u = U/√3
//   current amplitude               A = 2 V I / (3 u cos φ), from the power that the bus gives (switching losses are part of R)
//   u cos φ = R A + p λ ω                                   (torque axis)
// (an ESC that says the voltage along the torque axis, run column duty_q, gives u cos φ itself: no inductance is needed; it is the voltage
// that was meant, and what dead times take of it beyond their compensation is a constant of the fit) Where the ESC has measured R and L at
// rest (run.toml, [winding]) they are taken from there: the drop across R is a fifth of the voltage at full speed, so that 1 % of the
// voltage is 5 % of an R from these steps, and R's error goes into K_v. Torque is 3/2 p λ A less friction. K_v is the no-load speed per
// volt of line-to-line EMF amplitude, 60 / (√3 2π p λ).
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/stand/evaluate/estimate/stand_run.hpp"

namespace rotorloop::stand {

struct MotorValue {
  double value = 0.0, u = 0.0;
};

struct MotorConstants {
  MotorValue emf_V_s;                      // of a phase, per mechanical rad/s: p λ
  MotorValue speed_constant_rpm_V;         // K_v
  MotorValue resistance_ohm;               // one phase, with the switches; at winding_degC
  std::optional<MeasuredWinding> winding;  // where resistance_ohm comes from the ESC at rest
  double winding_degC = kNotMeasured;
  std::optional<MotorValue> flux_linkage_Wb;    // needs pole pairs
  std::optional<MotorValue> no_load_current_A;  // I_0: current amplitude that makes no torque on the shaft
  std::optional<MotorValue> friction_N_m;       // the same as torque
  double relative_rms = 0.0;                    // of the voltage
  std::size_t steps = 0;
};

// Nothing where duty, voltage or current are not measured in at least five steps. The inductive drop p ω L A is taken into account where
// `inductance_H` > 0.
std::optional<MotorConstants> motor_constants(const StandRun& run, double running_torque_offset_N_m, double inductance_H);

}  // namespace rotorloop::stand
