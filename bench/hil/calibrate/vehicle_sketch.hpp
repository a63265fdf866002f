// A vehicle from what a scale, a ruler and data sheets say: blade, motor, plant and start file, every guess marked with its confidence. The
// guesses follow from size alone (similarity to the shipped vehicles); measurements replace them one by one.
#pragma once
#include <string>

#include "sim/esc/servable_limit.hpp"

namespace rotorloop::calibrate {

struct VehicleSketch {
  std::string name = "my quadrotor";
  double mass_kg = 0.0;      // ready to fly, battery included
  double wheelbase_m = 0.0;  // motor to motor, diagonally
  double diameter_m = 0.0, pitch_m = 0.0;
  int blades = 2;
  // Of a blade file in place of diameter and pitch; 0: guessed by size. Thrust and torque over speed squared are those of hover.
  bool own_blade = false;
  double blade_inertia_kg_m2 = 0.0, c_t_N_s2 = 0.0, c_q_N_m_s2 = 0.0;
  double kv_rpm_V = 0.0;             // no-load speed per volt between leads
  double line_resistance_ohm = 0.0;  // between two leads, as data sheets and meters say
  int pole_pairs = 7;
  double no_load_A = 0.0;  // from the battery; 0: guessed
  int cells = 4;
  double capacity_Ah = 0.0;      // 0: guessed
  double current_limit_A = 0.0;  // phase amplitude that the ESC may give
};

// Reads "6x4.5", "6x4.5x3" or "5.1x4.6x3 in": diameter and pitch in inches, blades. False when it is none.
bool parse_propeller(const std::string& text, VehicleSketch& sketch);

// Air that a vehicle's files are made for.
constexpr double kSketchDensity_kg_m3 = 1.2;

struct SketchFiles {  // `blade` is empty for a blade of one's own
  std::string blade, motor, plant, vehicle,
      scenario;  // blades/propeller.toml, motor.toml, plant.toml, start.toml, flights.toml of one folder
};

// Throws Error for numbers outside of what the files allow and for a current limit that the ESC cannot serve, naming the option to correct.
SketchFiles sketch_files(const VehicleSketch& sketch);

// The current limit that the vehicle's ESC can serve, with the inductance that its motor file gets and a full battery.
sim::ServableLimit sketch_servable(const VehicleSketch& sketch);

}  // namespace rotorloop::calibrate
