#include "bench/sysid/diagnose/wald.hpp"

#include <algorithm>
#include <cmath>

#include "bench/sysid/diagnose/ranking/refit.hpp"
#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"
#include "host/effects/rotor_groups.hpp"

namespace rotorloop::diagnose {

WaldTest wald_test(const identify::Identification& r, const Candidate& c, double fewest_u) {
  constexpr double kFewestBlocks = 4.0, kFlat = 1e-12;  // of a scaled eigenvalue: rounding
  const std::vector<int> parameters = parameters_of(c, r.problem.start.terms);
  ColumnSet at;
  std::vector<double> size;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const estimate::Estimate* e = r.fit.find(parameters[k]);
    if (!e || e->u <= 0.0) continue;
    at.push_back(e - r.fit.estimates.data());
    size.push_back(e->value - c.parameters[k].neutral);
  }
  WaldTest out;
  if (at.empty()) return out;
  const Eigen::MatrixXd along = host::common_part(c.id).empty() ? directions({}, at) : directions({at}, at);
  const Eigen::MatrixXd classical = along.transpose() * r.fit.covariance(at, at) * along;
  const Eigen::VectorXd scale = classical.diagonal().cwiseSqrt().cwiseInverse();
  const SymmetricEigen eig = symmetric_eigen(scale.asDiagonal() * classical * scale.asDiagonal());
  // Directions of unit classical variance, of which the robust one may be more.
  Eigen::MatrixXd unit = scale.asDiagonal() * eig.vectors;
  for (Eigen::Index i = 0; i < unit.cols(); ++i) unit.col(i) *= eig.values[i] > kFlat ? 1.0 / std::sqrt(eig.values[i]) : 0.0;
  const Eigen::MatrixXd whole = along * unit;
  const SymmetricEigen robust = symmetric_eigen(whole.transpose() * r.fit.robust_covariance(at, at) * whole);
  const Eigen::VectorXd z = robust.vectors.transpose() * whole.transpose() *
                            Eigen::Map<const Eigen::VectorXd>(size.data(), static_cast<Eigen::Index>(size.size()));
  out.degrees = static_cast<int>((eig.values.array() > kFlat).count());
  if (out.degrees == 0) return out;
  out.statistic = (z.array().square() / robust.values.array().max(1.0)).sum() / out.degrees;
  const double blocks = std::max(kFewestBlocks, static_cast<double>(r.fit.blocks));
  out.inflation = robust.values.array().max(1.0).mean();
  out.blocks = blocks;
  out.p = f_tail(out.statistic, out.degrees, blocks);
  out.sure = f_tail(fewest_u * fewest_u, 1.0, blocks);
  return out;
}

}  // namespace rotorloop::diagnose
