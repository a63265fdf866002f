// What the table of a screening says of each candidate by itself: the criteria that need no refit.
#pragma once
#include <string>
#include <vector>

#include "bench/diagnose/diagnosis.hpp"
#include "bench/diagnose/screening.hpp"

namespace rotorloop::diagnose {

// When an effect is taken for real. All must hold.
struct Criteria {
  double p = 0.02;            // of the block-robust statistic, after Holm
  double placebo = 0.99;      // share of columns without meaning that its statistic must surpass
  double relevant = 0.33;     // of the size that matters (a term's scale): a smaller effect is left out, however certain
  double held_share = 0.1;    // of its gain that must also show on blocks that did not estimate it
  double overshoot = 0.3;     // of the way from neutral to a bound, by which an estimate of one step may pass the bound
  double fewest_u = 3.3;      // robust standard errors after the refit; of several numbers a Wald test of that chance
  double class_margin = 3.0;  // of log likelihood, deflated for correlated residuals, within which two effects are indistinguishable
  double alike = 0.98;        // correlation of columns from which on no refit could distinguish them either
  double much_alike = 0.9;    // … and from which on two that explain as much are one class, refitted or not
  double law_error = 0.3;     // of a law's own load, by which reduced laws are off: what such an error leaves is no further effect …
  double own_share = 0.5;     // … which keeps this much of its Δ log-likelihood once what varies as the law of each other has taken its part (law_remainder.hpp)
  double stood_in = 0.1;      // of what an effect explained alone: one worth less beside those found later stood in for them, and goes again
  double variation = 0.6;     // of a size on the body between stretches of a second, over that size: beyond it it is not one effect …
  double scatter = 4.0;       // … if it is the first, and these scatter by more than what the reduced laws of a whole model leave, as a variance over noise
};

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
