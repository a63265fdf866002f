// What the flights of a fit make of the priors from its vehicle file (bench/sysid/identify/vehicle_priors.hpp). Guesses are not judged.
#pragma once
#include <vector>

#include "bench/sysid/identify/vehicle_priors.hpp"

namespace rotorloop::diagnose {

using identify::vehicle_priors;

// A prior that the flights contradict.
struct Contradiction {
  int parameter = 0;
  double prior = 0.0, prior_u = 0.0;
  double found = 0.0, found_u = 0.0;  // by file and flights together
  // How far the flights moved it, over what they could have moved it by chance: were both right, that is of variance prior_u² - found_u²
  // (Evans and Moshonov, Checking for prior-data conflict, 2006). Larger where the blocks of the flights scatter more than their noise.
  double z = 0.0;
};
// Those beyond 3.5, the worst first. `problem`: as it was fitted, priors of the file included.
std::vector<Contradiction> contradictions(const estimate::FitProblem& problem, const estimate::Fit& fit);

}  // namespace rotorloop::diagnose
