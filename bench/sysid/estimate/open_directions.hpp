#pragma once
#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

namespace rotorloop::estimate {

// A direction of the parameters that is unobservable in the data.
struct OpenDirection {
  double information = 0.0;  // eigenvalue of the information matrix scaled to unit diagonal: 0 to number of parameters
  std::vector<std::pair<std::string, double>> parts;  // parameter names and their share, largest first
};
// From an information matrix: the eigen-directions below `limit`.
std::vector<OpenDirection> open_directions(const Eigen::MatrixXd& information, const std::vector<std::string>& names, double limit);

}  // namespace rotorloop::estimate
