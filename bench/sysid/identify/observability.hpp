// Observability: the weakest directions of the parameters by name, strong correlations, what each flight
// contributes per second, and which manoeuvre would determine the rest.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/estimate/estimator.hpp"

namespace rotorloop::identify {

struct CorrelatedPair {
  std::string first, second;
  double correlation = 0.0;
};

// What a flight says about a parameter by itself.
struct FlightContribution {
  std::string flight;
  double seconds = 0.0;
  std::vector<double> information;        // of each free parameter, the others known: 1/u², SI; all free parameters in order
  std::vector<std::string> undetermined;  // parameters that this flight alone leaves uncertain by more than their own size
};

// A manoeuvre for a parameter that is poorly determined.
struct Advice {
  std::string parameter;
  std::string why;  // "known to 40 % of its value"
  std::string manoeuvre;
};

struct Observability {
  double condition = 0.0;                        // of the information scaled to unit diagonal
  std::vector<double> eigenvalues;               // of the same, ascending
  std::vector<estimate::OpenDirection> weakest;  // the three weakest directions
  std::vector<CorrelatedPair> correlated;        // |correlation| > 0.9
  std::vector<FlightContribution> flights;
  std::vector<Advice> advice;
};

Observability observability_of(const estimate::FitProblem& problem, const estimate::Fit& fit);

// The manoeuvre that excites a parameter.
std::string manoeuvre_for(int parameter, const host::TermList& terms);

}  // namespace rotorloop::identify
