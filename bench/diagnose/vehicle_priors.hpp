// Priors of a fit from the vehicle file: values with their uncertainty and, where the file has them, their covariance; and static
// thrust found on a stand. Guesses give no prior. And, after the fit, what the flights make of it.
#pragma once
#include <span>
#include <vector>

#include "bench/estimate/estimator.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::diagnose {

// About the free, shared parameters among `free`.
std::vector<estimate::JointPrior> vehicle_priors(const host::VehicleFile& vehicle, std::span<const estimate::FreeParameter> free,
                                                 const estimate::ModelValues& file_values);

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
