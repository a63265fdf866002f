// What is known of a stand before a run: standard uncertainties (type B of the GUM, JCGM 100) of everything that a run itself cannot
// show. Each carries where it comes from, so that a budget says which of its terms somebody looked up and which are only usual.
#pragma once
#include <map>
#include <string>

#include "bench/stand/run_folder.hpp"

namespace rotorloop::stand {

struct KnownU {
  double u = 0.0;
  std::string source = "typical";  // "typical", "stand file", "run", "option"
};

// Typical values: thrust_stand.md lists them with their reasons.
struct StandUncertainty {
  KnownU thrust_calibration{0.004};  // relative: weights and the cell's gain
  KnownU torque_calibration{0.004};  // relative
  KnownU arm_length{0.002};          // relative: torque by weight times arm
  KnownU alignment_rad{0.035};       // between thrust and the cell's axis
  KnownU rotor_speed{5e-4};          // relative: the ESC's clock
  KnownU air_density{3e-3};          // relative
  KnownU voltage{3e-3};              // relative
  KnownU current{5e-3};              // relative
  KnownU zero_thrust{0.005};         // share of the largest reading; of no part where the run has zeros of its own
  KnownU zero_torque{0.005};         // the same of torque
  KnownU hysteresis{0.005};          // share of the largest reading; of no part where the run goes up and down
  KnownU cross_talk_m{0.0, "none"};  // thrust that shows as torque after the calibration matrix, N m per N
  KnownU cross_talk_share{0.005};    // the same as a share of the torque, where the stand file does not say cross_talk_m
};

// Of [uncertainty] of a run or stand file (read_uncertainties); typical values for what it leaves out.
StandUncertainty stand_uncertainty(const std::map<std::string, double>& given, const std::string& source);

}  // namespace rotorloop::stand
