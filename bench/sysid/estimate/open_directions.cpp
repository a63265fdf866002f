#include "bench/sysid/estimate/open_directions.hpp"

#include <algorithm>
#include <cmath>

#include "bench/sysid/estimate/newton_step.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::estimate {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<OpenDirection> open_directions(const MatrixXd& information, const std::vector<std::string>& names, double limit) {
  std::vector<OpenDirection> out;
  const VectorXd k = unit_scaling(information);
  const SymmetricEigen eig = symmetric_eigen(k.asDiagonal() * information * k.asDiagonal());
  for (Eigen::Index i = 0; i < information.rows() && eig.values[i] < limit; ++i) {
    OpenDirection d{eig.values[i], {}};
    std::vector<Eigen::Index> order(static_cast<std::size_t>(information.rows()));
    for (std::size_t j = 0; j < order.size(); ++j) order[j] = static_cast<Eigen::Index>(j);
    const VectorXd v = eig.vectors.col(i);
    std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return std::fabs(v[a]) > std::fabs(v[b]); });
    for (const Eigen::Index j : order) {
      if (std::fabs(v[j]) < 0.1) break;
      d.parts.emplace_back(names[static_cast<std::size_t>(j)], v[j]);
    }
    out.push_back(std::move(d));
  }
  return out;
}

}  // namespace rotorloop::estimate
