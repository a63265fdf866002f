// A staged fit where there are priors: first their parameters are held, and the states, the noise and the parameters without a prior
// settle about them; then all is free. The noise takes most of the sweeps, and one with few columns takes a third of the time.
#pragma once
#include <functional>
#include <optional>

#include "bench/sysid/estimate/estimator.hpp"

namespace rotorloop::estimate {

// The same problem with every shared parameter that a prior speaks of held where the priors together have it most likely, and no longer
// free. Weak priors hold nothing. Without others: the same problem.
FitProblem with_priors_held(const FitProblem& problem);
bool any_prior_holds(const FitProblem& problem);

// Where the next fit of `problem` starts, from what `fit` of it, or of it with priors held, left: states, noise, and values but for
// those that a single prior is about, for a prior's mean is the start.
void start_from(const Fit& fit, FitProblem& problem);

// The same for one parameter of every flight.
void start_at(FitProblem& problem, int parameter, double value);

// Sets the starts of `problem` by a fit with its priors' parameters held, and returns it. Nothing without priors.
std::optional<Fit> settle_with_priors_held(FitProblem& problem, const std::function<Fit(const FitProblem&)>& fit);

}  // namespace rotorloop::estimate
