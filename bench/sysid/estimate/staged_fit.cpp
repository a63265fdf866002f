#include "bench/sysid/estimate/staged_fit.hpp"

#include <algorithm>
#include <map>

#include "bench/sysid/estimate/newton_step.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::estimate {
namespace {

// Whether the prior knows something of every direction of its parameters.
bool says_all(const JointPrior& prior) {
  if (prior.weak) return false;
  if (prior.information.size() == 0 || prior.information.diagonal().minCoeff() <= 0.0) return false;
  const Eigen::VectorXd scale = unit_scaling(prior.information);
  const LdltFactor factor(scale.asDiagonal() * prior.information * scale.asDiagonal());
  constexpr double kFlat = 1e-12;  // of a scaled pivot: rounding
  return factor.succeeded() && factor.least_pivot() > kFlat;
}

bool held_by_itself(const FreeParameter& f) { return f.prior_u > 0.0 && !f.per_flight; }

}  // namespace

void start_at(FitProblem& p, int parameter, double value) {
  p.start[parameter] = value;
  for (auto& own : p.flight_start) own[static_cast<std::size_t>(parameter)] = value;
}

bool any_prior_holds(const FitProblem& p) {
  return std::any_of(p.free.begin(), p.free.end(), held_by_itself) || std::any_of(p.priors.begin(), p.priors.end(), says_all);
}

FitProblem with_priors_held(const FitProblem& problem) {
  FitProblem out = problem;
  std::map<int, Eigen::Index> place;  // of the parameters that priors hold
  for (const JointPrior& prior : problem.priors) {
    if (!says_all(prior)) continue;
    for (const int parameter : prior.parameters) place.emplace(parameter, static_cast<Eigen::Index>(place.size()));
  }
  if (!place.empty()) {
    // The most likely point of all priors that speak of held parameters only.
    const auto n = static_cast<Eigen::Index>(place.size());
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(n);
    const auto of_held = [&](const JointPrior& prior) {
      return std::all_of(prior.parameters.begin(), prior.parameters.end(), [&](int p) { return place.contains(p); });
    };
    for (const JointPrior& prior : problem.priors) {
      if (!of_held(prior)) continue;
      std::vector<Eigen::Index> at;
      for (const int parameter : prior.parameters) at.push_back(place.at(parameter));
      information(at, at) += prior.information;
      pull(at) += prior.information * prior.mean;
    }
    const Eigen::VectorXd likely = solve_scaled(information, pull);
    for (const auto& [parameter, at] : place) start_at(out, parameter, likely[at]);
    std::erase_if(out.priors, of_held);
  }
  std::erase_if(out.free, [&](const FreeParameter& f) { return held_by_itself(f) || (!f.per_flight && place.contains(f.parameter)); });
  return out;
}

void start_from(const Fit& fit, FitProblem& p) {
  p.flight_noise = fit.noise;
  p.states = fit.states;
  p.flight_start.clear();
  for (const ModelValues& v : fit.values) p.flight_start.push_back(v.values);
  for (const FreeParameter& f : p.free) {
    const auto at = static_cast<std::size_t>(f.parameter);
    if (f.prior_u > 0.0) {
      for (auto& own : p.flight_start) own[at] = p.start.values[at];
    } else if (!f.per_flight) {
      p.start.values[at] = fit.values.front().values[at];
    }
  }
}

std::optional<Fit> settle_with_priors_held(FitProblem& problem, const std::function<Fit(const FitProblem&)>& fit) {
  if (!any_prior_holds(problem)) return std::nullopt;
  std::optional<Fit> held = fit(with_priors_held(problem));
  start_from(*held, problem);
  return held;
}

}  // namespace rotorloop::estimate
