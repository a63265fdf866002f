// One result of `identify` among several, and what a vehicle file says of the same parameters.
#pragma once
#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace rotorloop::identify {

struct HistoryPoint {
  std::string label;  // folder of the result
  // Shared parameters by symbol, then what follows from them ("c_t", "D(8.5 m/s)"); u is the larger of classical and robust.
  std::vector<std::string> names, units;
  std::vector<double> value, u;
  std::optional<Eigen::Quaterniond> q_BS;  // none in results that do not say it
};

// What a vehicle file says, drawn across the trials.
struct HistoryReference {
  std::string label;
  std::map<std::string, double> value;  // by symbol
  Eigen::Quaterniond q_BS = Eigen::Quaterniond::Identity();
};

}  // namespace rotorloop::identify
