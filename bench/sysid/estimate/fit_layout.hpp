// The unknown numbers of a fit in one row, and what is known of them beforehand.
#pragma once
#include <vector>

#include "bench/sysid/estimate/fit_problem.hpp"

namespace rotorloop::estimate {

// Everything about the free numbers: which column of the whole each column of a flight is.
struct Layout {
  std::vector<Estimate> estimates;                   // at their start values
  std::vector<std::vector<Eigen::Index>> of_flight;  // flight's column -> estimate
  Columns columns;                                   // of every flight
};
Layout make_layout(const FitProblem& problem);  // throws Error when there are more than a fit can take

// Values of each flight for the estimates of the moment.
std::vector<ModelValues> flight_values(const FitProblem& problem, const Layout& layout, const Eigen::VectorXd& theta);

// Gaussian knowledge about the estimates, in their order.
class Priors {
 public:
  Priors(const FitProblem& problem, const Layout& layout);
  const Eigen::MatrixXd& information() const { return information_; }
  const Eigen::MatrixXd& scatter() const {
    return scatter_;
  }  // covariance of the score, the priors' means being uncertain: information times weight
  Eigen::VectorXd score(const Eigen::VectorXd& theta) const;
  double cost(const Eigen::VectorXd& theta) const;

 private:
  struct Part {
    Eigen::VectorXd mean;
    Eigen::MatrixXd information;
  };
  Part spread(const JointPrior& prior, const Layout& layout) const;
  Eigen::Index size_;
  std::vector<Part> parts_;
  Eigen::MatrixXd information_, scatter_;
};

}  // namespace rotorloop::estimate
