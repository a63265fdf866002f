#include "bench/diagnose/refit.hpp"

#include <algorithm>
#include <cmath>

#include "bench/estimate/flight_motion.hpp"
#include "bench/estimate/known_first.hpp"

namespace rotorloop::bench {
namespace {

// A copy whose problem points into its own flights and starts where `last` ended. Priors stay about what they were about.
Identification continued(const Identification& last) {
  Identification out;
  out.flights = last.flights;
  out.start = last.start;
  out.problem = last.problem;
  out.problem.flights.clear();
  for (const GridFlight& g : out.flights) out.problem.flights.push_back(&g);
  start_from(last.fit, out.problem);
  return out;
}

constexpr int kRounds = 4;      // of fits, each from where the one before ended, with the terms remembering along its states
constexpr double kStill = 0.2;  // of a standard uncertainty: a change below it needs no further round

// Values and states with what is known held: an effect that could hide behind it must first stand for itself, for many have a second,
// lesser optimum. The noise stays out of this: where what is known is wrong it would swell. Returns the cost there.
std::optional<double> settle_values(Identification& r, const FitOptions& options) {
  if (r.problem.start.terms.memory() > 0 && !r.problem.states.empty()) follow_states(r.flights, r.problem.states);
  FitOptions values_only = options;
  values_only.noise.rounds = 0;
  const std::optional<Fit> held = settle_about_known(r.problem, [&](const FitProblem& p) { return fit(p, values_only); });
  return held ? std::optional(held->cost) : std::nullopt;
}

void run(Identification& r, const FitOptions& options) {
  const bool memory = r.problem.start.terms.memory() > 0;
  r.fit = fit(r.problem, options);
  for (int again = 1; memory && again < kRounds; ++again) {
    const std::vector<Estimate> before = r.fit.estimates;
    const bool converged = r.fit.converged;
    Identification next = continued(r);
    follow_states(next.flights, next.problem.states);
    next.fit = fit(next.problem, options);
    r = std::move(next);
    bool still = converged;
    for (std::size_t i = 0; i < before.size(); ++i)
      still = still && std::fabs(r.fit.estimates[i].value - before[i].value) <= kStill * r.fit.estimates[i].u;
    if (still) break;
  }
}

}  // namespace

Identification at_beliefs(const Identification& fitted, const FitOptions& options) {
  if (!anything_known(fitted.problem)) return copy_of(fitted);
  Identification out = continued(fitted);
  if (out.problem.start.terms.memory() > 0) follow_states(out.flights, out.problem.states);
  settle_about_known(out.problem, [&](const FitProblem& held) { return fit(held, options); });
  FitOptions as_it_is = options;
  as_it_is.max_iterations = 0;
  out.fit = fit(out.problem, as_it_is);
  return out;
}

Identification copy_of(const Identification& fitted) {
  Identification out = continued(fitted);
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
    for (std::size_t k = 0; k < c.parameters.size(); ++k) out.push_back(kCoreParameters + static_cast<int>(terms.first_parameter(t) + k));
  }
  return out;
}

std::optional<double> cost_held(const Identification& last, const std::vector<NoiseModel>& noise, const FitOptions& options) {
  Identification out = continued(last);
  out.problem.flight_noise = noise;
  return settle_values(out, options);
}

Refit begin_refit(const Identification& last, const Candidate& c, const Eigen::VectorXd& estimate, const std::vector<NoiseModel>& noise,
                  const FitOptions& options) {
  Refit refit{.fit = continued(last), .cost_held = {}};
  Identification& out = refit.fit;
  FitProblem& p = out.problem;
  p.flight_noise = noise;
  if (c.term) {
    const std::size_t before = p.start.terms.parameters();
    p.start.terms.add(*c.term);
    // Terms stand behind the core parameters: the new ones are last, and what they remember starts at rest.
    const auto grow = [&](std::vector<double>& values) { values.resize(kCoreParameters + p.start.terms.parameters(), 0.0); };
    grow(p.start.values);
    for (auto& own : p.flight_start) grow(own);
    out.start.values.terms = out.start.file.terms = p.start.terms;
    for (auto* values : {&out.start.values.values, &out.start.file.values}) {
      values->resize(kCoreParameters + before);
      for (const CandidateParameter& q : c.parameters) values->push_back(q.neutral);
      grow(*values);
    }
    for (std::size_t k = before; k < p.start.terms.parameters(); ++k) {
      if (p.start.terms.is_start(k) && p.start.terms.start_u(k) > 0.0)
        p.free.push_back({kCoreParameters + static_cast<int>(k), p.flights.size() > 1, p.start.terms.start_u(k)});
    }
  }
  const std::vector<int> parameters = parameters_of(c, p.start.terms);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const CandidateParameter& q = c.parameters[k];
    start_at(p, parameters[k], std::clamp(q.neutral + estimate[static_cast<Eigen::Index>(k)], q.min, q.max));
    p.free.push_back({parameters[k], false, 0.0});
  }
  refit.cost_held = settle_values(out, options);
  return refit;
}

void finish_refit(Refit& refit, const FitOptions& options) { run(refit.fit, options); }

Identification refit_without(const Identification& last, const Candidate& c, const FitOptions& options) {
  Identification out = continued(last);
  FitProblem& p = out.problem;
  const std::vector<int> parameters = parameters_of(c, p.start.terms);
  // Held at neutral: a term that changes nothing may stay in the list.
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    start_at(p, parameters[k], c.parameters[k].neutral);
    std::erase_if(p.free, [&](const FreeParameter& f) { return f.parameter == parameters[k]; });
  }
  if (c.term) {
    std::erase_if(p.free, [&](const FreeParameter& f) {
      const int flat = f.parameter - kCoreParameters;
      return flat >= 0 && p.start.terms.is_start(static_cast<std::size_t>(flat)) &&
             p.start.terms.term(p.start.terms.term_of(static_cast<std::size_t>(flat))).info.id == c.id;
    });
  }
  settle_values(out, options);
  run(out, options);
  return out;
}

}  // namespace rotorloop::bench
