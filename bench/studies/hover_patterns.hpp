// What each kind of defect does to the demands of the four rotors in hover.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "host/vehicle/model.hpp"

namespace rotorloop::studies {

struct HoverPattern {
  std::vector<std::string> ids;                               // effects/catalogue.toml; with the rotor, "weak_rotor 2"
  int rotor = 0;                                              // 1 to 4 when the defect is of that rotor alone
  std::vector<std::pair<std::string, std::string>> unknowns;  // name, unit
  Eigen::MatrixXd change;                                     // 4 rows: relative change of each rotor's demand for one of each unknown
  // In words, what the estimate contradicts; empty when it may be.
  std::function<std::string(const Eigen::VectorXd&)> outside;
};

std::vector<HoverPattern> hover_patterns(const host::VehicleModel& vehicle);

// Names of what one rotor may have, as hover_patterns gives them.
std::string weak_rotor_id(int rotor);
std::string weak_motor_id(int rotor);
std::string load_at_rotor_id(int rotor);
std::string blocked_wake_id(int rotor);

}  // namespace rotorloop::studies
