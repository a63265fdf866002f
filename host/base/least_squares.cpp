#include "host/base/least_squares.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/error.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMostDamping = 1e8, kLeastDamping = 1e-9;

// Takes parameter k out of the normal equations: its step becomes `slope` / 1.
void hold(MatrixXd& information, Index k) {
  information.row(k).setZero();
  information.col(k).setZero();
  information(k, k) = 1.0;
}

}  // namespace

Descent descend(const VectorXd& start, const VectorXd& min, const VectorXd& max, const Cost& cost, const DescentOptions& o) {
  Descent d{.x = start.cwiseMax(min).cwiseMin(max)};
  double damping = o.damping;
  NormalEquations at;
  for (; d.iterations < o.max_iterations && !d.converged; ++d.iterations) {
    d.cost = cost(d.x, &at);
    for (Index k = 0; k < d.x.size(); ++k) {
      if (!((d.x[k] <= min[k] && at.slope[k] > 0.0) || (d.x[k] >= max[k] && at.slope[k] < 0.0))) continue;
      hold(at.information, k);
      at.slope[k] = 0.0;
    }
    bool improved = false;
    for (; damping < kMostDamping && !improved; damping *= 10.0) {
      MatrixXd damped = at.information;
      damped.diagonal() *= 1.0 + damping;
      const VectorXd next = (d.x - LdltFactor(damped).solve(at.slope)).cwiseMax(min).cwiseMin(max);
      const double next_cost = cost(next, nullptr);
      if (!(next_cost < d.cost)) continue;
      improved = true;
      d.converged = d.cost - next_cost <= o.tolerance * d.cost;
      d.x = next;
      d.cost = next_cost;
    }
    if (!improved) d.converged = true;  // no direction goes down
    damping = std::max(kLeastDamping, 0.01 * damping);
  }
  return d;
}

LeastSquaresFit fit_least_squares(const std::vector<BoundedParameter>& parameters, const Residuals& residuals,
                                  const DescentOptions& options) {
  const auto n = static_cast<Index>(parameters.size());
  LeastSquaresFit fit;
  const auto at = [&](const VectorXd& x) {
    ++fit.evaluations;
    return residuals({x.data(), x.data() + x.size()});
  };
  VectorXd start(n), min(n), max(n);
  for (Index k = 0; k < n; ++k) {
    const BoundedParameter& p = parameters[static_cast<std::size_t>(k)];
    start[k] = p.start;
    min[k] = p.min;
    max[k] = p.max;
  }
  const auto jacobian = [&](const VectorXd& x, Index rows) {
    MatrixXd j(rows, n);
    for (Index k = 0; k < n; ++k) {
      const double difference = parameters[static_cast<std::size_t>(k)].difference;
      VectorXd low = x, high = x;
      low[k] = std::max(min[k], x[k] - difference);
      high[k] = std::min(max[k], x[k] + difference);
      j.col(k) = (at(high) - at(low)) / (high[k] - low[k]);
    }
    return j;
  };
  const VectorXd first = at(start.cwiseMax(min).cwiseMin(max));
  if (first.size() <= n || !first.allFinite())
    throw Error(
        {"least squares", fmt::format("{} residuals for {} parameters, or not finite at the start", first.size(), n), "", "give more rows"},
        ExitCode::data_quality);
  const auto cost = [&](const VectorXd& x, NormalEquations* equations) {
    const VectorXd r = at(x);
    if (equations) {
      const MatrixXd j = jacobian(x, r.size());
      *equations = {j.transpose() * j, j.transpose() * r};
    }
    return r.squaredNorm();
  };
  const Descent d = descend(start, min, max, cost, options);
  NormalEquations end;
  const double squares = cost(d.x, &end);
  for (Index k = 0; k < n; ++k) {
    fit.at_bound.push_back(d.x[k] <= min[k] || d.x[k] >= max[k]);
    if (fit.at_bound.back()) hold(end.information, k);
  }
  fit.information = end.information;
  const LdltFactor factor(end.information);
  fit.covariance = MatrixXd::Constant(n, n, std::numeric_limits<double>::infinity());
  if (factor.least_pivot() > 0.0) fit.covariance = factor.inverse() * squares / static_cast<double>(first.size() - n);
  for (Index k = 0; k < n; ++k) {
    fit.values.push_back(d.x[k]);
    fit.standard_errors.push_back(fit.at_bound[static_cast<std::size_t>(k)] ? std::numeric_limits<double>::quiet_NaN()
                                                                            : std::sqrt(fit.covariance(k, k)));
  }
  fit.rms = std::sqrt(squares / static_cast<double>(first.size()));
  fit.converged = d.converged;
  return fit;
}

}  // namespace rotorloop
