#include "bench/sysid/identify/observability.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/sysid/identify/identified_vehicle.hpp"
#include "host/base/symmetric_matrix.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::identify {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kStrong = 0.9;  // correlation worth a line
constexpr double kPoor = 0.25;   // uncertainty by value above which more flying is advised
constexpr std::size_t kWeakest = 3;
constexpr double kOpen = std::numeric_limits<double>::infinity();

// What an uncertainty is measured against: the parameter's own size, or, near zero, the change that matters.
double size_of(double value, int parameter, const host::TermList& terms) {
  return std::max(std::fabs(value), estimate::parameter_info(parameter, terms).scale);
}

// Standard uncertainty of each column from one flight alone, the parameters its priors hold taken as known; infinite when open.
VectorXd alone(const MatrixXd& information, const VectorXd& prior_weight) {
  const MatrixXd s = information + MatrixXd(prior_weight.asDiagonal());
  VectorXd k = s.diagonal();
  for (Eigen::Index i = 0; i < k.size(); ++i) k[i] = k[i] > 0.0 ? 1.0 / std::sqrt(k[i]) : 0.0;
  const SymmetricEigen eig = symmetric_eigen(k.asDiagonal() * s * k.asDiagonal());
  VectorXd u = VectorXd::Zero(s.rows());
  for (Eigen::Index i = 0; i < s.rows(); ++i) {
    double variance = k[i] > 0.0 ? 0.0 : kOpen;
    for (Eigen::Index j = 0; j < s.rows() && std::isfinite(variance); ++j) {
      const double part = eig.vectors(i, j) * eig.vectors(i, j);
      if (eig.values[j] > 1e-12) {
        variance += part / eig.values[j];
      } else if (part > 1e-6) {
        variance = kOpen;
      }
    }
    u[i] = std::sqrt(variance) * k[i];
    if (k[i] <= 0.0) u[i] = kOpen;
  }
  return u;
}

}  // namespace

std::string manoeuvre_for(int p, const host::TermList& terms) {
  switch (p) {
    case estimate::kMass:
      return "none: weigh the vehicle; every force and inertia scales with it";
    case estimate::kIxx:
      return "quick rolls to both sides, 5 rad/s and more";
    case estimate::kIyy:
      return "quick pitching both ways, 5 rad/s and more";
    case estimate::kIzz:
    case estimate::kCq:
      return "yaw steps both ways with fast rotor response; slow and fast ones distinguish I_zz from c_q";
    case estimate::kIxy:
    case estimate::kIxz:
    case estimate::kIyz:
      return "turns about two axes at once";
    case estimate::kComX:
    case estimate::kComY:
      return "any hover; yaw turns distinguish it from a tilted pose frame";
    case estimate::kK1:
    case estimate::kK2:
      return "fast climbs and descents (3 m/s and more) beside hover: k_1 and k_2 differ only when the inflow does";
    case estimate::kCdh:
    case estimate::kCdxy:
      return "horizontal flight at several speeds up to 8 m/s and more: c_d,h grows with speed, c_d,xy with its square";
    case estimate::kCdz:
      return "climbs and descents of 4 m/s and more, or fast flight with much tilt";
    case estimate::kTiltX:
    case estimate::kTiltY:
      return "hover turned through 360 degrees";
    case estimate::kOffsetX:
    case estimate::kOffsetY:
    case estimate::kOffsetZ:
      return "quick turns about all three axes";
    case estimate::kTurnX:
    case estimate::kTurnY:
    case estimate::kTurnZ:
      return "accelerations along x and y at several headings";
    case estimate::kPoseDelay:
    case estimate::kRotorDelay:
      return "quick turns about all three axes";
    case estimate::kCommandGain:
    case estimate::kCommandOffset:
    case estimate::kVoltageExponent:
      return "hover over most of the battery's charge";
    case estimate::kCommandLag:
      return "steps of thrust and torque";
    default:
      break;
  }
  if (p >= estimate::kGyroBiasX && p <= estimate::kGyroBiasZ) return "a few seconds of hover";
  if (p >= estimate::kAccelBiasX && p <= estimate::kAccelBiasZ) return "hover at several headings";
  if (p >= estimate::kImuX && p <= estimate::kImuZ) return "quick turns about all three axes";
  const auto flat = static_cast<std::size_t>(p - estimate::kCoreParameters);
  const std::string id(terms.term(terms.term_of(flat)).info.id);
  const host::CatalogueEffect* row = host::builtin_effect_catalogue().find(id);
  if (row && !row->manoeuvre.empty()) return row->manoeuvre;
  // A term of the user's own, which the catalogue does not know.
  return fmt::format("what changes the load of {} by much while the rest of the motion stays as it is", id);
}

Observability observability_of(const estimate::FitProblem& problem, const estimate::Fit& fit) {
  Observability out;
  const host::TermList& terms = problem.start.terms;
  const auto n = static_cast<Eigen::Index>(fit.estimates.size());
  std::vector<std::string> names;
  for (const estimate::Estimate& e : fit.estimates) names.push_back(estimate::estimate_name(e, problem));

  MatrixXd s = fit.information;
  for (Eigen::Index i = 0; i < n; ++i) {
    const estimate::Estimate& e = fit.estimates[static_cast<std::size_t>(i)];
    if (fit.covariance(i, i) > 0.0) s(i, i) += e.prior_share / fit.covariance(i, i);
  }
  out.weakest = estimate::open_directions(s, names, 1e300);
  for (const estimate::OpenDirection& d : out.weakest) out.eigenvalues.push_back(d.information);
  out.condition = out.eigenvalues.empty() ? 0.0 : out.eigenvalues.back() / std::max(out.eigenvalues.front(), 1e-300);
  out.weakest.resize(std::min(out.weakest.size(), kWeakest));

  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = a + 1; b < n; ++b) {
      const double r = fit.covariance(a, b) / std::sqrt(fit.covariance(a, a) * fit.covariance(b, b));
      if (std::fabs(r) > kStrong) out.correlated.push_back({names[static_cast<std::size_t>(a)], names[static_cast<std::size_t>(b)], r});
    }
  }
  std::sort(out.correlated.begin(), out.correlated.end(),
            [](const CorrelatedPair& a, const CorrelatedPair& b) { return std::fabs(a.correlation) > std::fabs(b.correlation); });

  VectorXd prior_weight = VectorXd::Zero(static_cast<Eigen::Index>(problem.free.size()));
  for (std::size_t i = 0; i < problem.free.size(); ++i) {
    const double u = problem.free[i].prior_u;
    if (u > 0.0) prior_weight[static_cast<Eigen::Index>(i)] = 1.0 / (u * u);
  }
  for (std::size_t f = 0; f < problem.flights.size(); ++f) {
    const estimate::GridFlight& g = *problem.flights[f];
    FlightContribution c{g.name, 0.0, {}, {}};
    for (const auto linked : g.linked) c.seconds += linked ? g.step_s : 0.0;
    const MatrixXd& own = fit.reduced[f].information;
    const VectorXd u = alone(own, prior_weight);
    for (std::size_t i = 0; i < problem.free.size(); ++i) {
      const int p = problem.free[i].parameter;
      const auto at = static_cast<Eigen::Index>(i);
      c.information.push_back(own(at, at));
      if (p != estimate::kMass && u[at] > size_of(fit.values[f][p], p, terms))
        c.undetermined.push_back(estimate::parameter_info(p, terms).symbol);
    }
    out.flights.push_back(std::move(c));
  }

  for (std::size_t i = 0; i < fit.estimates.size(); ++i) {
    const estimate::Estimate& e = fit.estimates[i];
    if (e.parameter == estimate::kMass) continue;
    const double relative = reported_u(e) / size_of(e.value, e.parameter, terms);
    const std::string why = e.prior_share > 0.5 ? "its prior holds more than half of what is known"
                            : relative > kPoor  ? fmt::format("known to {:.0f} % of its size only", 100.0 * relative)
                                                : "";
    if (!why.empty()) out.advice.push_back({names[i], why, manoeuvre_for(e.parameter, terms)});
  }
  return out;
}

}  // namespace rotorloop::identify
