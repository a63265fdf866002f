#include "bench/sysid/estimate/newton_step.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::estimate {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd unit_scaling(const MatrixXd& s) {
  VectorXd d = s.diagonal();
  for (Eigen::Index i = 0; i < d.size(); ++i) d[i] = d[i] > 0.0 ? 1.0 / std::sqrt(d[i]) : 1.0;
  return d;
}

VectorXd solve_scaled(const MatrixXd& s, const VectorXd& rhs, double damping) {
  const VectorXd k = unit_scaling(s);
  MatrixXd a = k.asDiagonal() * s * k.asDiagonal();
  a.diagonal().array() *= 1.0 + damping;
  const VectorXd scaled_rhs = k.asDiagonal() * rhs;
  return k.asDiagonal() * LdltFactor(a).solve(scaled_rhs);
}

MatrixXd inverse_scaled(const MatrixXd& s) {
  const VectorXd k = unit_scaling(s);
  const MatrixXd a = k.asDiagonal() * s * k.asDiagonal();
  return k.asDiagonal() * LdltFactor(a).inverse() * k.asDiagonal();
}

VectorXd step_inside(const FitProblem& p, const Layout& l, const VectorXd& theta, const MatrixXd& s, const VectorXd& score,
                     double damping) {
  const Eigen::Index n = theta.size();
  VectorXd step = VectorXd::Zero(n), lowest(n), highest(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const ParameterInfo info = parameter_info(l.estimates[static_cast<std::size_t>(i)].parameter, p.start.terms);
    lowest[i] = info.min > 0.0 ? std::max(info.min - theta[i], -0.8 * theta[i]) : info.min - theta[i];
    highest[i] = info.max - theta[i];
  }
  std::vector<Eigen::Index> open(static_cast<std::size_t>(n)), held;
  for (Eigen::Index i = 0; i < n; ++i) open[static_cast<std::size_t>(i)] = i;
  while (!open.empty()) {
    VectorXd rhs = -score(open);
    if (!held.empty()) rhs -= s(open, held) * step(held);
    step(open) = solve_scaled(s(open, open), rhs, damping);
    // The one that goes too far by the most, in units of its way to the bound, is held; then the rest is solved anew.
    double worst = 1.0 + 1e-9;
    auto stops = open.end();
    for (auto i = open.begin(); i != open.end(); ++i) {
      const double way = step[*i] < 0.0 ? lowest[*i] : highest[*i], excess = way != 0.0 ? step[*i] / way : (step[*i] != 0.0 ? 1e300 : 0.0);
      if (excess > worst) {
        worst = excess;
        stops = i;
      }
    }
    if (stops == open.end()) break;
    step[*stops] = step[*stops] < 0.0 ? lowest[*stops] : highest[*stops];
    held.push_back(*stops);
    open.erase(stops);
  }
  return step;
}

}  // namespace rotorloop::estimate
