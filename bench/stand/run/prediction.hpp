// What a plan will ask of stand and propeller, before anything is armed: thrust, torque, current and time, and which ranges it exceeds.
#pragma once
#include <string>
#include <vector>

#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/sequence.hpp"

namespace rotorloop::stand_run {

// Of the propeller in still air: the stand file's, else those of any propeller of the diameter, known to a factor of two.
struct ExpectedCoefficients {
  double c_t_N_s2 = 0.0, c_q_N_m_s2 = 0.0;
  bool typical_c_t = false, typical_c_q = false;
};
ExpectedCoefficients expected_coefficients(const modbus::StandSetup& setup);

struct Prediction {
  struct Level {
    double omega_rad_s = 0.0, thrust_N = 0.0, torque_N_m = 0.0, power_W = 0.0, current_A = 0.0;
    int times = 0;
  };
  std::vector<Level> levels;  // by speed
  double duration_s = 0.0, energy_J = 0.0;
  bool typical_coefficients = false;  // the stand file names none: a propeller of its diameter, to a factor of two
  std::vector<std::string> exceeded;  // nothing is armed
  std::vector<std::string> warnings;
};

// `supply_V` and the drive's efficiency turn shaft power into current.
Prediction predict(const modbus::StandSetup& setup, const Plan& plan, double settle_s, double supply_V);
// For people, and as one JSON document.
std::string prediction_text(const modbus::StandSetup& setup, const Plan& plan, const Prediction& p);
std::string prediction_json(const modbus::StandSetup& setup, const Plan& plan, const Prediction& p);

}  // namespace rotorloop::stand_run
