// What a vehicle is capable of, from its plant alone and before it flies: for `hil --dry-run`, which also refuses what cannot fly.
#pragma once
#include <string>

#include "bench/hil/flight/flight.hpp"
#include "sim/esc/servable_limit.hpp"

namespace rotorloop::hil {

struct VehicleFigures {
  double kv_rpm_V = 0.0;
  double hover_rpm = 0.0, hover_phase_A = 0.0, hover_bus_A = 0.0;  // one motor; the whole battery's current
  double hover_voltage_share = 0.0;                                // of what the bridge can give at 3.5 V per cell
  double top_rpm = 0.0, thrust_to_weight = 0.0;                    // within current and voltage limits at 3.5 V per cell
  double hover_slew_rad_s2 = 0.0;                                  // how fast a rotor speeds up from hover within both limits
  double esc_max_rpm = 0.0, phase_limit_A = 0.0;
  sim::ServableLimit servable;  // of the ESC that holds the least, with the battery full
  double empty_V = 0.0, full_V = 0.0, stage_V = 0.0;
};

// Of rotor 1 but for what the ESCs can serve; hover and top by the plant's own rotor and motor in still air.
VehicleFigures vehicle_figures(const sim::PlantFile& plant, const sim::SharedRotors& rotors);

// Lines for --dry-run.
std::string figures_text(const VehicleFigures& figures);

// Throws Error that names figure, value, unit, limit and remedy when the vehicle cannot take off, or asks of its ESCs what they cannot
// serve.
void check_figures(const Scenario& scenario, const Inputs& inputs, const VehicleFigures& figures);

// Reads every file of a scenario, checks its vehicle, and returns the lines. Throws Error.
std::string checked_vehicle_text(const Scenario& scenario);

}  // namespace rotorloop::hil
