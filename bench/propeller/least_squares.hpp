// Levenberg-Marquardt between bounds, for a handful of parameters and residuals that cost microseconds: the Jacobian is taken by
// central differences. A parameter at its bound that wants to go beyond it rests there for the step.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace rotorloop::propeller {

struct BoundedParameter {
  std::string name;
  std::string unit;  // "1" for a plain number
  double start, min, max;
  double difference;  // step of the numerical derivative
};

struct LeastSquaresFit {
  std::vector<double> values;           // in the order of the parameters
  std::vector<double> standard_errors;  // from the residuals' scatter; not-a-number for a parameter at its bound
  std::vector<bool> at_bound;
  double rms = 0.0;     // of the residuals
  int evaluations = 0;  // of the residual vector
  bool converged = false;
};

using Residuals = std::function<Eigen::VectorXd(const std::vector<double>&)>;

// Minimises the sum of squares. Throws Error (data_quality) for fewer residuals than parameters or residuals that are not finite
// at the start.
LeastSquaresFit fit_least_squares(const std::vector<BoundedParameter>& parameters, const Residuals& residuals);

}  // namespace rotorloop::propeller
