// Small least squares between bounds by damped Gauss-Newton steps (Levenberg-Marquardt): the one descent for fits of a handful of
// parameters (docs/decisions/0102). A parameter at its bound that wants to go beyond it rests there for the step.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace rotorloop {

struct DescentOptions {
  int max_iterations = 60;
  double tolerance = 1e-7;  // relative fall of the cost by a step that ends the search
  double damping = 1e-3;    // of the first step: the diagonal of the information grows by this share
};

// Gauss-Newton's quadratic model of a cost at a point.
struct NormalEquations {
  Eigen::MatrixXd information;  // JᵀJ, weighted
  Eigen::VectorXd slope;        // Jᵀr, weighted
};

// The cost at x, which may have any factor; with `equations` the model there, too. Not finite: as if it were worse.
using Cost = std::function<double(const Eigen::VectorXd& x, NormalEquations* equations)>;

struct Descent {
  Eigen::VectorXd x;
  double cost = 0.0;
  int iterations = 0;
  bool converged = false;  // a step fell by less than the tolerance, or no direction goes down
};

// `min`, `max`: as long as `start`; infinite where there is no bound.
Descent descend(const Eigen::VectorXd& start, const Eigen::VectorXd& min, const Eigen::VectorXd& max, const Cost& cost,
                const DescentOptions& options = {});

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
  Eigen::MatrixXd information;  // JᵀJ at the values; 1 on the diagonal and nothing beside it for a parameter at its bound
  Eigen::MatrixXd covariance;   // its inverse times the residuals' variance; infinite where the residuals leave a direction open
  double rms = 0.0;             // of the residuals
  int evaluations = 0;          // of the residual vector
  bool converged = false;
};

using Residuals = std::function<Eigen::VectorXd(const std::vector<double>&)>;

// Minimises the sum of squares; the Jacobian is taken by central differences. Throws Error (data_quality) for fewer residuals than
// parameters or residuals that are not finite at the start.
LeastSquaresFit fit_least_squares(const std::vector<BoundedParameter>& parameters, const Residuals& residuals,
                                  const DescentOptions& options = {});

}  // namespace rotorloop
