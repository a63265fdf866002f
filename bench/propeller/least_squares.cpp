#include "bench/propeller/least_squares.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace {
constexpr int kMaxIterations = 60;
constexpr double kConverged = 1e-7;  // relative gain of the sum of squares by a step
constexpr double kFirstDamping = 1e-3, kMostDamping = 1e8;

class Problem {
 public:
  Problem(const std::vector<BoundedParameter>& parameters, const Residuals& residuals) : parameters_(parameters), residuals_(residuals) {}

  Eigen::VectorXd at(const Eigen::VectorXd& x) {
    ++evaluations;
    return residuals_({x.data(), x.data() + x.size()});
  }
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& x, Eigen::Index rows) {
    Eigen::MatrixXd j(rows, x.size());
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const auto& p = parameters_[static_cast<std::size_t>(k)];
      Eigen::VectorXd low = x, high = x;
      low[k] = std::max(p.min, x[k] - p.difference);
      high[k] = std::min(p.max, x[k] + p.difference);
      j.col(k) = (at(high) - at(low)) / (high[k] - low[k]);
    }
    return j;
  }
  bool at_min(const Eigen::VectorXd& x, Eigen::Index k) const { return x[k] <= parameters_[static_cast<std::size_t>(k)].min; }
  bool at_max(const Eigen::VectorXd& x, Eigen::Index k) const { return x[k] >= parameters_[static_cast<std::size_t>(k)].max; }
  Eigen::VectorXd within(Eigen::VectorXd x) const {
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const auto& p = parameters_[static_cast<std::size_t>(k)];
      x[k] = std::clamp(x[k], p.min, p.max);
    }
    return x;
  }
  int evaluations = 0;

 private:
  const std::vector<BoundedParameter>& parameters_;
  const Residuals& residuals_;
};
}  // namespace

LeastSquaresFit fit_least_squares(const std::vector<BoundedParameter>& parameters, const Residuals& residuals) {
  Problem problem(parameters, residuals);
  const auto n = static_cast<Eigen::Index>(parameters.size());
  Eigen::VectorXd x(n);
  for (Eigen::Index k = 0; k < n; ++k) x[k] = parameters[static_cast<std::size_t>(k)].start;
  x = problem.within(x);
  Eigen::VectorXd r = problem.at(x);
  if (r.size() <= n || !r.allFinite())
    throw Error(
        {"least squares", fmt::format("{} residuals for {} parameters, or not finite at the start", r.size(), n), "", "give more rows"},
        ExitCode::data_quality);
  double squares = r.squaredNorm(), damping = kFirstDamping;
  Eigen::MatrixXd j;
  LeastSquaresFit fit;
  for (int iteration = 0; iteration < kMaxIterations && !fit.converged; ++iteration) {
    j = problem.jacobian(x, r.size());
    Eigen::MatrixXd information = j.transpose() * j;
    Eigen::VectorXd slope = j.transpose() * r;
    for (Eigen::Index k = 0; k < n; ++k)
      if ((problem.at_min(x, k) && slope[k] > 0.0) || (problem.at_max(x, k) && slope[k] < 0.0)) {
        information.row(k).setZero();
        information.col(k).setZero();
        information(k, k) = 1.0;
        slope[k] = 0.0;
      }
    bool improved = false;
    for (; damping < kMostDamping && !improved; damping *= 10.0) {
      Eigen::MatrixXd damped = information;
      damped.diagonal() *= 1.0 + damping;
      const Eigen::VectorXd next = problem.within(x - damped.ldlt().solve(slope));
      const Eigen::VectorXd next_r = problem.at(next);
      const double next_squares = next_r.squaredNorm();
      if (!(next_squares < squares)) continue;
      improved = true;
      fit.converged = squares - next_squares <= kConverged * squares;
      x = next;
      r = next_r;
      squares = next_squares;
    }
    if (!improved) fit.converged = true;  // no direction goes down
    damping = std::max(1e-9, 0.01 * damping);
  }
  j = problem.jacobian(x, r.size());
  Eigen::MatrixXd information = j.transpose() * j;
  for (Eigen::Index k = 0; k < n; ++k) {
    fit.at_bound.push_back(problem.at_min(x, k) || problem.at_max(x, k));
    if (!fit.at_bound.back()) continue;
    information.row(k).setZero();
    information.col(k).setZero();
    information(k, k) = 1.0;
  }
  const Eigen::MatrixXd covariance = information.inverse() * squares / static_cast<double>(r.size() - n);
  for (Eigen::Index k = 0; k < n; ++k) {
    fit.values.push_back(x[k]);
    fit.standard_errors.push_back(fit.at_bound[static_cast<std::size_t>(k)] ? std::numeric_limits<double>::quiet_NaN()
                                                                            : std::sqrt(covariance(k, k)));
  }
  fit.rms = std::sqrt(squares / static_cast<double>(r.size()));
  fit.evaluations = problem.evaluations;
  return fit;
}

}  // namespace rotorloop::propeller
