#include "bench/sysid/identify/solver_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/sysid/estimate/ceres_solver.hpp"
#include "bench/sysid/estimate/staged_fit.hpp"
#include "host/base/error.hpp"

namespace rotorloop::identify {
namespace {

// Of docs/acceptance/identify_speed.md.
constexpr double kAcceptedCost = 1e-8, kAcceptedEstimate_u = 1e-4, kAcceptedUncertainty = 1e-6;
constexpr double kFarCost = 1e-6, kFarEstimate_u = 0.25, kFarUncertainty = 0.05;
// A cost that can fall by no more than this leaves every estimate within 1e-4 of its standard uncertainty: u² / 2.
constexpr double kToTheEnd = 0.5 * kAcceptedEstimate_u * kAcceptedEstimate_u;
constexpr int kIterations = 200;  // where each step gains a factor of two only

double ratio(double difference, double by) {
  if (difference == 0.0) return 0.0;
  return by > 0.0 ? difference / by : std::numeric_limits<double>::infinity();
}

}  // namespace

FitDifference difference_of_fits(const estimate::Fit& own, const estimate::Fit& ceres, const estimate::FitProblem& problem) {
  const auto farther = [](double x, double than) { return std::isnan(x) || std::fabs(x) > std::fabs(than); };
  FitDifference out;
  out.cost = ratio(ceres.cost - own.cost, std::fabs(own.cost));
  for (std::size_t i = 0; i < own.estimates.size(); ++i) {
    const estimate::Estimate &a = own.estimates[i], &b = ceres.estimates[i];
    const double moved = ratio(b.value - a.value, a.u), grown = ratio(b.u - a.u, a.u);
    if (i == 0 || farther(moved, out.estimate_u)) {
      out.estimate_u = moved;
      out.estimate = estimate::estimate_name(a, problem);
    }
    if (i == 0 || farther(grown, out.uncertainty)) {
      out.uncertainty = grown;
      out.of = estimate::estimate_name(a, problem);
    }
  }
  return out;
}

bool within_acceptance(const FitDifference& d) {
  return std::fabs(d.cost) <= kAcceptedCost && std::fabs(d.estimate_u) <= kAcceptedEstimate_u &&
         std::fabs(d.uncertainty) <= kAcceptedUncertainty;
}

bool far_apart(const FitDifference& reported, const FitDifference& to_the_end) {
  return !(std::fabs(to_the_end.cost) <= kFarCost && std::fabs(reported.estimate_u) <= kFarEstimate_u &&
           std::fabs(reported.uncertainty) <= kFarUncertainty);
}

estimate::FitOptions check_options(estimate::FitOptions of_fit) {
  of_fit.noise.rounds = 0;
  of_fit.innovations = false;
  of_fit.tolerance = kToTheEnd;
  of_fit.max_iterations = kIterations;
  return of_fit;
}

SolverCheck check_by_ceres(const Identification& result, const estimate::FitOptions& options,
                           const std::function<void(const estimate::FitProgress&)>& progress) {
  const estimate::FitOptions to_the_end = check_options(options);
  estimate::FitProblem as_begun = result.problem, as_ended = result.problem;
  as_begun.flight_noise = result.fit.noise;
  estimate::start_from(result.fit, as_ended);
  SolverCheck out;
  out.own_cost = result.fit.cost;
  try {
    const estimate::Fit ceres = estimate::fit_with_ceres(as_begun, to_the_end, progress);
    const estimate::Fit own = estimate::fit(as_ended, to_the_end);
    out.own_cost = own.cost;
    out.ceres_cost = ceres.cost;
    out.iterations = ceres.iterations;
    out.converged = ceres.converged;
    out.reported = difference_of_fits(result.fit, ceres, result.problem);
    out.to_the_end = difference_of_fits(own, ceres, result.problem);
  } catch (const Error& e) {
    out.failure = e.text().what;
  }
  return out;
}

std::string solver_check_problem(const SolverCheck& c) {
  if (!c.failure.empty()) return "the check by Ceres came to no answer: " + c.failure;
  if (!c.converged) return fmt::format("the check by Ceres did not converge in {} iterations", c.iterations);
  if (!far_apart(c.reported, c.to_the_end)) return "";
  return fmt::format(
      "Ceres and the own solver give different answers: {} by {:+.2g} standard uncertainties (at most {:g}), the uncertainty of {} by "
      "{:+.2g} % "
      "(at most {:g} %), the cost by {:+.2g} of it (at most {:g})",
      c.reported.estimate, c.reported.estimate_u, kFarEstimate_u, c.reported.of, 100.0 * c.reported.uncertainty, 100.0 * kFarUncertainty,
      c.to_the_end.cost, kFarCost);
}

std::string solver_check_text(const SolverCheck& c) {
  if (!c.failure.empty()) return solver_check_problem(c) + "\n";
  const auto apart = [](const FitDifference& d) {
    return fmt::format("estimates at most {:.1g} standard uncertainties apart ({}), uncertainties at most {:.1g} of themselves ({})",
                       std::fabs(d.estimate_u), d.estimate, std::fabs(d.uncertainty), d.of);
  };
  std::string out = fmt::format("the same fit by Ceres: cost {:.9g} after {} iterations{}, by the own solver {:.9g}\n", c.ceres_cost,
                                c.iterations, c.converged ? "" : " (NOT CONVERGED)", c.own_cost);
  out += fmt::format("  as reported above: {}\n", apart(c.reported));
  out += fmt::format("  both to the end: {}, cost {:.1g} of it: {} the limits of docs/acceptance/identify_speed.md ({:g}, {:g}, {:g})\n",
                     apart(c.to_the_end), std::fabs(c.to_the_end.cost), within_acceptance(c.to_the_end) ? "within" : "OUTSIDE",
                     kAcceptedEstimate_u, kAcceptedUncertainty, kAcceptedCost);
  return out;
}

}  // namespace rotorloop::identify
