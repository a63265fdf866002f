// A fit once more with one effect more, or one less: from the states and values that the last one left.
#pragma once
#include <optional>

#include "bench/diagnose/screening.hpp"

namespace rotorloop::bench {

// A fit with one effect more, begun: values and states have settled with what is known held and the noise as given.
struct Refit {
  Identification fit;
  std::optional<double> cost_held;  // there; none where nothing is known
};
// `estimate`: of the candidate's parameters, about their neutral values; where the new fit starts. `noise`: of each flight, likewise.
Refit begin_refit(const Identification& last, const Candidate& candidate, const Eigen::VectorXd& estimate,
                  const std::vector<NoiseModel>& noise, const FitOptions& options);
void finish_refit(Refit& refit, const FitOptions& options);
// The same cost without the effect.
std::optional<double> cost_held(const Identification& last, const std::vector<NoiseModel>& noise, const FitOptions& options);

Identification refit_without(const Identification& last, const Candidate& candidate, const FitOptions& options);

// The same model with what is known beforehand at its known values, and all else fitted: states, noise, what nothing was known of. Here
// what the model lacks stands in the residuals as it is; in the fit itself the known values have moved to hide as much of it as they can.
// The problem keeps its priors as they were. Without priors: the same fit.
Identification at_beliefs(const Identification& fitted, const FitOptions& options);

// The same fit, its problem pointing into its own flights.
Identification copy_of(const Identification& fitted);

// The candidate's parameters in a fit that has it.
std::vector<int> parameters_of(const Candidate& candidate, const host::TermList& terms);

}  // namespace rotorloop::bench
