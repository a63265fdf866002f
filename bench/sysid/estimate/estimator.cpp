#include "bench/sysid/estimate/estimator.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "bench/sysid/estimate/gauss_newton.hpp"
#include "bench/sysid/estimate/newton_step.hpp"
#include "host/base/error.hpp"

namespace rotorloop::estimate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSingular = 1e-11;  // of the information scaled to unit diagonal: below it lies rounding

// Scatter of the block scores, with neighbours: the V of S⁻¹ V S⁻¹.
MatrixXd block_scatter(const Layout& layout, Fit& out) {
  const auto n = static_cast<Eigen::Index>(layout.estimates.size());
  MatrixXd v = MatrixXd::Zero(n, n);
  for (std::size_t f = 0; f < out.reduced.size(); ++f) {
    std::vector<VectorXd> scores;
    for (const ScoreBlock& b : out.reduced[f].blocks) {
      VectorXd u = VectorXd::Zero(n);
      for (std::size_t c = 0; c < layout.columns.size(); ++c) u[layout.of_flight[f][c]] = b.score[static_cast<Eigen::Index>(c)];
      scores.push_back(u);
    }
    for (std::size_t b = 0; b < scores.size(); ++b) {
      v += scores[b] * scores[b].transpose();
      if (b + 1 < scores.size()) {
        const MatrixXd cross = scores[b] * scores[b + 1].transpose();
        v += 0.5 * (cross + cross.transpose());
      }
    }
    out.blocks += scores.size();
  }
  if (out.blocks > 1) v *= static_cast<double>(out.blocks) / static_cast<double>(out.blocks - 1);
  return v;
}

std::vector<Estimate> estimates_of(const FitProblem& p, const GaussNewton& run, const Fit& out) {
  const VectorXd prior_share = (run.priors().information() * out.covariance).diagonal();
  std::vector<Estimate> estimates = run.layout().estimates;
  for (Eigen::Index i = 0; i < run.theta().size(); ++i) {
    Estimate& e = estimates[static_cast<std::size_t>(i)];
    const double start = e.value;
    e.value = run.theta()[i];
    e.u = std::sqrt(std::max(0.0, out.covariance(i, i)));
    e.u_robust = std::sqrt(std::max(0.0, out.robust_covariance(i, i)));
    e.prior_share = prior_share[i];
    for (const FreeParameter& f : p.free) {
      if (f.parameter == e.parameter && f.prior_u > 0.0) e.prior_z = (e.value - start) / f.prior_u;
    }
    const ParameterInfo info = parameter_info(e.parameter, p.start.terms);
    e.at_bound = e.value <= info.min || e.value >= info.max;
  }
  return estimates;
}

void count_likelihood(const FitProblem& p, double cost, Fit& out) {
  out.cost = cost;
  out.log_likelihood = -cost;
  double residuals = 0.0, states = 0.0;
  for (std::size_t f = 0; f < p.flights.size(); ++f) {
    residuals += static_cast<double>(out.reduced[f].residuals);
    states += 12.0 * static_cast<double>(p.flights[f]->tied_nodes());
    out.log_likelihood -= 0.5 * out.reduced[f].log_det_states + log_standard_deviations(*p.flights[f], out.noise[f]);
  }
  out.degrees_of_freedom = residuals - states - static_cast<double>(out.estimates.size());
}

[[noreturn]] void refuse(const FitProblem& p, const GaussNewton& run, const Fit& out, const std::vector<OpenDirection>& open) {
  std::string text, where;
  for (const GridFlight* g : p.flights) where += (where.empty() ? "" : ", ") + g->name;
  for (const OpenDirection& d : open) {
    text += text.empty() ? "" : "; ";
    for (std::size_t i = 0; i < d.parts.size(); ++i)
      text += fmt::format("{}{} ({:+.2f})", i ? ", " : "", d.parts[i].first, d.parts[i].second);
  }
  if (run.observable_at_start()) {  // whether it ended or not: where residuals are flat every step promises nothing
    throw Error(
        {where,
         fmt::format("the fit ran away: after {} iterations it no longer determines {}, which these flights determined at the start values",
                     out.iterations, text),
         "a model that is not these flights': rotor columns exchanged, a rotor speed that is scaled or lost for a while, a stream "
         "whose stamps are off, or start values far from the vehicle",
         "look at `rotorloop log info`, try each flight alone, hold what is known (--hold), or start from a better vehicle file"},
        ExitCode::data_quality);
  }
  throw Error({where, fmt::format("{} direction(s) of the parameters leave every residual unchanged: {}", open.size(), text),
               "the flights do not excite them, or no flight can distinguish them (mass and all forces; rotor arms and inertia)",
               "hold one of each direction at a measured value, or fly the manoeuvre that separates them (docs/manual/identifying.md)"},
              ExitCode::data_quality);
}

}  // namespace

Fit fit(const FitProblem& p, const FitOptions& o, const std::function<void(const FitProgress&)>& progress) {
  GaussNewton run(p, o);
  run.iterate(progress);
  run.linearise_for_results();
  const MatrixXd information = run.information_with_priors();
  if (const auto open = open_directions(information, run.names(), kSingular); !open.empty()) refuse(p, run, run.fit(), open);
  Fit out = std::move(run.fit());
  out.covariance = inverse_scaled(information);
  out.information = run.information();
  const MatrixXd scatter = block_scatter(run.layout(), out);
  out.robust_covariance = out.covariance * (scatter + run.priors().scatter()) * out.covariance;
  out.estimates = estimates_of(p, run, out);
  count_likelihood(p, run.cost(), out);
  return out;
}

}  // namespace rotorloop::estimate
