// What the table of a screening says of each candidate by itself: the criteria that need no refit.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/diagnose/decision_rules.hpp"
#include "bench/sysid/diagnose/diagnosis.hpp"
#include "bench/sysid/diagnose/screening.hpp"

namespace rotorloop::diagnose {

// A candidate with all that the table says of it.
struct Tested {
  const Candidate* candidate = nullptr;
  GroupTest test = {};
  CandidateEvidence evidence = {};
  bool real = false;   // meets every criterion that needs no refit
  bool minor = false;  // every one but that it matters
};

// Largest parameter over the size that matters. `change`: of the candidate's parameters from their neutral values.
double relevance(const Candidate& candidate, const Eigen::VectorXd& change);

// All candidates against the model of the table, best first. `placebo`: statistic that nearly all placebos stay below.
std::vector<Tested> examine_all(const Screening& screening, const Criteria& criteria, double placebo);

}  // namespace rotorloop::diagnose
