#include "bench/diagnose/refit.hpp"

#include <algorithm>

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
  FitProblem& p = out.problem;
  p.flight_noise = last.fit.noise;
  p.states = last.fit.states;
  p.flight_start.clear();
  for (const ModelValues& v : last.fit.values) p.flight_start.push_back(v.values);
  for (const FreeParameter& f : p.free) {
    const auto at = static_cast<std::size_t>(f.parameter);
    if (f.prior_u > 0.0) {
      for (auto& own : p.flight_start) own[at] = p.start.values[at];
    } else if (!f.per_flight) {
      p.start.values[at] = last.fit.values.front().values[at];
    }
  }
  return out;
}

void set(FitProblem& p, int parameter, double value) {
  p.start[parameter] = value;
  for (auto& own : p.flight_start) own[static_cast<std::size_t>(parameter)] = value;
}

void run(Identification& r, const FitOptions& options) { r.fit = fit(r.problem, options); }

}  // namespace

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

Identification refit_with(const Identification& last, const Candidate& c, const Eigen::VectorXd& estimate, const FitOptions& options) {
  Identification out = continued(last);
  FitProblem& p = out.problem;
  if (c.term) {
    const std::size_t before = p.start.terms.parameters();
    p.start.terms.add(*c.term);
    // Terms stand behind the core parameters: the new ones are last.
    const auto grow = [&](std::vector<double>& values) { values.resize(kCoreParameters + before + c.parameters.size()); };
    grow(p.start.values);
    for (auto& own : p.flight_start) grow(own);
    out.start.values.terms = out.start.file.terms = p.start.terms;
    for (auto* values : {&out.start.values.values, &out.start.file.values}) {
      values->resize(kCoreParameters + before);
      for (const CandidateParameter& q : c.parameters) values->push_back(q.neutral);
    }
  }
  const std::vector<int> parameters = parameters_of(c, p.start.terms);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const CandidateParameter& q = c.parameters[k];
    set(p, parameters[k], std::clamp(q.neutral + estimate[static_cast<Eigen::Index>(k)], q.min, q.max));
    p.free.push_back({parameters[k], false, 0.0});
  }
  run(out, options);
  return out;
}

Identification refit_without(const Identification& last, const Candidate& c, const FitOptions& options) {
  Identification out = continued(last);
  FitProblem& p = out.problem;
  const std::vector<int> parameters = parameters_of(c, p.start.terms);
  // Held at neutral: a term that changes nothing may stay in the list.
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    set(p, parameters[k], c.parameters[k].neutral);
    std::erase_if(p.free, [&](const FreeParameter& f) { return f.parameter == parameters[k]; });
  }
  run(out, options);
  return out;
}

}  // namespace rotorloop::bench
