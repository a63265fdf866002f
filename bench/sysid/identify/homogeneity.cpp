#include "bench/sysid/identify/homogeneity.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::identify {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLeastInformation = 1e-9;  // of the information scaled to unit diagonal: the information of a flight on a direction at all
constexpr double kSmallestShare = 0.04;     // share of the joint information from which on a flight counts
constexpr double kHomogeneityLevel = 0.01;

struct FlightSummary {
  MatrixXd information;  // of the shared parameters, per-flight ones eliminated
  VectorXd score;
};

VectorXd unit_scale(const MatrixXd& s) {
  VectorXd k = s.diagonal();
  for (Eigen::Index i = 0; i < k.size(); ++i) k[i] = k[i] > 0.0 ? 1.0 / std::sqrt(k[i]) : 0.0;
  return k;
}

// Pseudo-inverse in the directions determined, scaled to unit diagonal first; `rank` counts them.
MatrixXd determined_inverse(const MatrixXd& s, double& rank) {
  const VectorXd k = unit_scale(s);
  const SymmetricEigen eig = symmetric_eigen(k.asDiagonal() * s * k.asDiagonal());
  VectorXd inverse = VectorXd::Zero(s.rows());
  rank = 0.0;
  for (Eigen::Index i = 0; i < s.rows(); ++i) {
    if (eig.values[i] > kLeastInformation) {
      inverse[i] = 1.0 / eig.values[i];
      rank += 1.0;
    }
  }
  return k.asDiagonal() * eig.vectors * inverse.asDiagonal() * eig.vectors.transpose() * k.asDiagonal();
}

// Columns of the shared or of the per-flight parameters. One that its prior holds (the mass) counts as known: freed in each flight,
// it would take the scale of all others with it. So does one at its bound: its scores do not sum to zero, which is no difference of
// flights.
std::vector<Eigen::Index> places(const estimate::FitProblem& p, const estimate::Fit& fit, bool per_flight) {
  std::vector<Eigen::Index> out;
  for (std::size_t i = 0; i < p.free.size(); ++i) {
    const estimate::Estimate* e = fit.find(p.free[i].parameter, 0);
    if (p.free[i].per_flight == per_flight && e && e->prior_share <= 0.5 && !e->at_bound) out.push_back(static_cast<Eigen::Index>(i));
  }
  return out;
}

FlightSummary summary_of(const estimate::FitProblem& p, const estimate::Fit& fit, const estimate::Reduced& r) {
  const auto shared = places(p, fit, false), own = places(p, fit, true);
  FlightSummary out{r.information(shared, shared), r.score(shared)};
  if (own.empty()) return out;
  double rank = 0.0;
  const MatrixXd inverse = determined_inverse(r.information(own, own), rank);
  const MatrixXd cross = r.information(shared, own);
  out.information -= cross * inverse * cross.transpose();
  out.score -= cross * inverse * r.score(own);
  return out;
}

// Of all parameters together: the scores of each flight, whose sum is zero. In the basis where the joint information is the identity,
// the eigenvalues of a flight's are its shares.
void add_scores(const FlightSummary& f, const VectorXd& scale, const LltFactor& joint, double inflation, Homogeneity& out) {
  const MatrixXd half = joint.solve_lower(MatrixXd(scale.asDiagonal() * f.information * scale.asDiagonal()));
  const SymmetricEigen eig = symmetric_eigen(joint.solve_lower(MatrixXd(half.transpose())));
  const VectorXd score = eig.vectors.transpose() * joint.solve_lower(VectorXd(scale.asDiagonal() * f.score));
  for (Eigen::Index i = 0; i < score.size(); ++i) {
    const double share = eig.values[i];
    if (share < kSmallestShare) continue;
    out.chi2 += score[i] * score[i] / (share * inflation);
    out.degrees += std::max(0.0, 1.0 - share);
  }
}

// Of one parameter, column `at` of the shared ones: each flight's own estimate and its variance with all others free, about their
// weighted mean.
ParameterHomogeneity of_parameter(int parameter, Eigen::Index at, const estimate::Estimate* joint, const MatrixXd& joint_inverse,
                                  const std::vector<FlightSummary>& flights) {
  ParameterHomogeneity h;
  h.parameter = parameter;
  // What correlated residuals add differs by parameter: a distorted one has a hundred times the classical variance beside others with
  // twice.
  const double own = joint && joint->u > 0.0 ? std::max(1.0, joint->u_robust * joint->u_robust / (joint->u * joint->u)) : 1.0;
  double weights = 0.0, sum = 0.0;
  for (const FlightSummary& f : flights) {
    double rank = 0.0;
    const MatrixXd inverse = determined_inverse(f.information, rank);
    // A parameter with a part in a direction that the flight does not determine is not determined.
    const MatrixXd resolution = inverse * f.information;
    const bool determined = inverse(at, at) > 0.0 && resolution(at, at) > 0.99 && kSmallestShare * inverse(at, at) < joint_inverse(at, at);
    h.value.push_back(determined && joint ? joint->value - inverse.row(at).dot(f.score) : std::numeric_limits<double>::quiet_NaN());
    h.u.push_back(determined ? std::sqrt(inverse(at, at) * own) : std::numeric_limits<double>::infinity());
    if (!determined) continue;
    weights += 1.0 / (h.u.back() * h.u.back());
    sum += h.value.back() / (h.u.back() * h.u.back());
    h.degrees += 1.0;
  }
  if (h.degrees < 2.0) {
    h.degrees = 0.0;
    return h;
  }
  for (std::size_t f = 0; f < h.value.size(); ++f) {
    if (std::isfinite(h.u[f])) h.chi2 += std::pow((h.value[f] - sum / weights) / h.u[f], 2);
  }
  h.degrees -= 1.0;
  h.p = chi_square_tail(h.chi2, h.degrees);
  h.moved = h.p < kHomogeneityLevel / static_cast<double>(joint_inverse.rows());
  return h;
}

}  // namespace

Homogeneity homogeneity_of(const estimate::FitProblem& problem, const estimate::Fit& fit, double inflation) {
  Homogeneity out;
  const auto shared = places(problem, fit, false);
  if (fit.reduced.size() < 2 || shared.empty()) return out;
  std::vector<FlightSummary> flights;
  for (const estimate::Reduced& r : fit.reduced) flights.push_back(summary_of(problem, fit, r));
  MatrixXd total = MatrixXd::Zero(flights.front().information.rows(), flights.front().information.cols());
  for (const FlightSummary& f : flights) total += f.information;
  const VectorXd scale = unit_scale(total);
  const LltFactor joint(scale.asDiagonal() * total * scale.asDiagonal());
  if (!joint.succeeded()) return out;
  for (const FlightSummary& f : flights) add_scores(f, scale, joint, inflation, out);
  out.p = out.degrees > 0.01 ? chi_square_tail(out.chi2, out.degrees) : 1.0;

  const MatrixXd joint_inverse = scale.asDiagonal() * joint.inverse() * scale.asDiagonal();
  for (std::size_t i = 0; i < shared.size(); ++i) {
    const int parameter = problem.free[static_cast<std::size_t>(shared[i])].parameter;
    out.parameters.push_back(of_parameter(parameter, static_cast<Eigen::Index>(i), fit.find(parameter), joint_inverse, flights));
  }
  return out;
}

}  // namespace rotorloop::identify
