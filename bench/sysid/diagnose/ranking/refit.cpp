#include "bench/sysid/diagnose/ranking/refit.hpp"

#include <algorithm>
#include <cmath>

#include "bench/sysid/estimate/flight_motion.hpp"
#include "bench/sysid/estimate/staged_fit.hpp"
#include "bench/sysid/identify/gauge.hpp"
#include "host/effects/rotor_groups.hpp"

namespace rotorloop::diagnose {
namespace {

// A copy whose problem points into its own flights and starts where `last` ended. Priors stay about what they were about.
identify::Identification continued(const identify::Identification& last) {
  identify::Identification out;
  out.flights = last.flights;
  out.start = last.start;
  out.problem = last.problem;
  out.problem.flights.clear();
  for (const estimate::GridFlight& g : out.flights) out.problem.flights.push_back(&g);
  estimate::start_from(last.fit, out.problem);
  return out;
}

constexpr int kRounds = 6;  // of fits, each from where the one before ended, with stateful terms re-propagated along its states
// Iterations of each round but the last: to end one along states that the next corrects would be in vain.
constexpr int kIterationsAlong = 20;
constexpr double kRefitSettled = 0.2;  // of a standard uncertainty: a change below it needs no further round

estimate::FitOptions along(estimate::FitOptions options) {
  options.max_iterations = std::min(options.max_iterations, kIterationsAlong);
  return options;
}

// Values and states with the priors' parameters held: an effect that could hide behind them must first stand for itself, for many have a
// second, lesser optimum. The noise stays out of this: where a prior is wrong it would swell. Returns the cost there.
std::optional<double> settle_values(identify::Identification& r, const estimate::FitOptions& options) {
  if (r.problem.start.terms.memory() > 0 && !r.problem.states.empty()) estimate::follow_states(r.flights, r.problem.states);
  estimate::FitOptions values_only = options;
  values_only.noise.rounds = 0;
  if (r.problem.start.terms.memory() > 0) values_only = along(values_only);
  const std::optional<estimate::Fit> held =
      estimate::settle_with_priors_held(r.problem, [&](const estimate::FitProblem& p) { return estimate::fit(p, values_only); });
  return held ? std::optional(held->cost) : std::nullopt;
}

void run(identify::Identification& r, const estimate::FitOptions& options) {
  const bool memory = r.problem.start.terms.memory() > 0;
  r.fit = estimate::fit(r.problem, memory ? along(options) : options);
  for (int again = 1; memory && again < kRounds; ++again) {
    const std::vector<estimate::Estimate> before = r.fit.estimates;
    const bool converged = r.fit.converged;
    identify::Identification next = continued(r);
    estimate::follow_states(next.flights, next.problem.states);
    next.fit = estimate::fit(next.problem, again + 1 < kRounds ? along(options) : options);
    r = std::move(next);
    bool still = converged;
    for (std::size_t i = 0; i < before.size(); ++i)
      still = still && std::fabs(r.fit.estimates[i].value - before[i].value) <= kRefitSettled * r.fit.estimates[i].u;
    if (still) break;
  }
}

}  // namespace

identify::Identification at_priors(const identify::Identification& fitted, const estimate::FitOptions& options) {
  if (!estimate::any_prior_holds(fitted.problem)) return copy_of(fitted);
  identify::Identification out = continued(fitted);
  if (out.problem.start.terms.memory() > 0) estimate::follow_states(out.flights, out.problem.states);
  estimate::settle_with_priors_held(out.problem, [&](const estimate::FitProblem& held) { return estimate::fit(held, options); });
  estimate::FitOptions as_it_is = options;
  as_it_is.max_iterations = 0;
  out.fit = estimate::fit(out.problem, as_it_is);
  return out;
}

identify::Identification copy_of(const identify::Identification& fitted) {
  identify::Identification out = continued(fitted);
  out.problem = fitted.problem;
  for (std::size_t f = 0; f < out.flights.size(); ++f) out.problem.flights[f] = &out.flights[f];
  out.fit = fitted.fit;
  return out;
}

std::vector<int> parameters_of(const Candidate& c, const host::TermList& terms) {
  if (!c.term) return c.core;
  std::vector<int> out;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (terms.term(t).info.id != c.id) continue;
    for (std::size_t k = 0; k < c.parameters.size(); ++k)
      out.push_back(estimate::kCoreParameters + static_cast<int>(terms.first_parameter(t) + k));
  }
  return out;
}

std::optional<double> cost_held(const identify::Identification& last, const std::vector<estimate::NoiseModel>& noise,
                                const estimate::FitOptions& options) {
  identify::Identification out = continued(last);
  out.problem.flight_noise = noise;
  return settle_values(out, options);
}

Refit begin_refit(const identify::Identification& last, const Candidate& c, const Eigen::VectorXd& estimate,
                  const std::vector<estimate::NoiseModel>& noise, const estimate::FitOptions& options) {
  Refit refit{.fit = continued(last), .cost_held = {}};
  identify::Identification& out = refit.fit;
  estimate::FitProblem& p = out.problem;
  p.flight_noise = noise;
  if (c.term) {
    const std::size_t before = p.start.terms.parameters();
    p.start.terms.add(*c.term);
    // Terms stand behind the core parameters: the new ones are last, and their state starts at rest.
    const auto grow = [&](std::vector<double>& values) { values.resize(estimate::kCoreParameters + p.start.terms.parameters(), 0.0); };
    grow(p.start.values);
    for (auto& own : p.flight_start) grow(own);
    out.start.values.terms = out.start.file.terms = p.start.terms;
    for (auto* values : {&out.start.values.values, &out.start.file.values}) {
      values->resize(estimate::kCoreParameters + before);
      for (const CandidateParameter& q : c.parameters) values->push_back(q.neutral);
      grow(*values);
    }
    for (std::size_t k = before; k < p.start.terms.parameters(); ++k) {
      if (p.start.terms.is_start(k) && p.start.terms.start_u(k) > 0.0)
        p.free.push_back({estimate::kCoreParameters + static_cast<int>(k), p.flights.size() > 1, p.start.terms.start_u(k)});
    }
  }
  const std::vector<int> parameters = parameters_of(c, p.start.terms);
  if (!host::common_part(c.id).empty())
    p.priors.push_back(identify::prior_of_sum(parameters, p.start, identify::common_part_known(c.id, p.priors)));
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const CandidateParameter& q = c.parameters[k];
    estimate::start_at(p, parameters[k], std::clamp(q.neutral + estimate[static_cast<Eigen::Index>(k)], q.min, q.max));
    p.free.push_back({parameters[k], false, 0.0});
  }
  refit.cost_held = settle_values(out, options);
  return refit;
}

void finish_refit(Refit& refit, const estimate::FitOptions& options) { run(refit.fit, options); }

identify::Identification refit_without(const identify::Identification& last, const Candidate& c, const estimate::FitOptions& options) {
  identify::Identification out = continued(last);
  estimate::FitProblem& p = out.problem;
  const std::vector<int> parameters = parameters_of(c, p.start.terms);
  // Held at neutral: a term that changes nothing may stay in the list.
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    estimate::start_at(p, parameters[k], c.parameters[k].neutral);
    std::erase_if(p.free, [&](const estimate::FreeParameter& f) { return f.parameter == parameters[k]; });
  }
  if (c.term) {
    std::erase_if(p.free, [&](const estimate::FreeParameter& f) {
      const int flat = f.parameter - estimate::kCoreParameters;
      return flat >= 0 && p.start.terms.is_start(static_cast<std::size_t>(flat)) &&
             p.start.terms.term(p.start.terms.term_of(static_cast<std::size_t>(flat))).info.id == c.id;
    });
  }
  std::erase_if(p.priors, [&](const estimate::JointPrior& prior) { return prior.parameters == parameters; });
  settle_values(out, options);
  run(out, options);
  return out;
}

}  // namespace rotorloop::diagnose
