// The joint fit once more by Ceres, and how far the two answers lie apart: what `rotorloop identify --solver ceres` reports.
// Noise figures are those that the own solver found. Ceres begins where the joint fit began; the own solver goes on from where it ended,
// since it stops at a hundredth of a standard uncertainty and the comparison looks closer than that.
#pragma once
#include <functional>
#include <string>

#include "bench/sysid/identify/identify.hpp"

namespace rotorloop::identify {

// How far two fits of one problem lie apart.
struct FitDifference {
  double cost = 0.0;          // of the own cost
  double estimate_u = 0.0;    // largest, in standard uncertainties of the own fit; signed: Ceres minus own
  std::string estimate = {};  // whose
  double uncertainty = 0.0;   // largest, of the own standard uncertainty; signed
  std::string of = {};        // whose
};
FitDifference difference_of_fits(const estimate::Fit& own, const estimate::Fit& ceres, const estimate::FitProblem& problem);

// What test_identify_ceres demands (docs/acceptance/identify_speed.md), of fits that ran to their end.
bool within_acceptance(const FitDifference& to_the_end);
// Beyond this the digits that a person reads differ: a quarter of a standard uncertainty, uncertainties by 5 %, the cost by 1e-6 of it.
// The fit that is reported may lie 0.01 from its end, and 0.2 with stateful terms (their motion follows once more after the last round).
bool far_apart(const FitDifference& reported, const FitDifference& to_the_end);

struct SolverCheck {
  double own_cost = 0.0, ceres_cost = 0.0;
  int iterations = 0;  // of Ceres
  bool converged = false;
  FitDifference reported;    // the fit that is reported against Ceres
  FitDifference to_the_end;  // the own fit run to its end against Ceres
  std::string failure;       // why there is no comparison: what Ceres said; empty when there is one

  bool good() const { return failure.empty() && converged && !far_apart(reported, to_the_end); }
};

// With the noise kept, and to the end: the options of a check of a fit that had these.
estimate::FitOptions check_options(estimate::FitOptions of_fit);

// Does not throw what Ceres says of the problem: that is `failure`. `progress` is that of Ceres, which takes by far the most time.
SolverCheck check_by_ceres(const Identification& result, const estimate::FitOptions& options,
                           const std::function<void(const estimate::FitProgress&)>& progress = {});

std::string solver_check_text(const SolverCheck& check);     // some lines, each ended
std::string solver_check_problem(const SolverCheck& check);  // what is wrong; empty when it is good

}  // namespace rotorloop::identify
