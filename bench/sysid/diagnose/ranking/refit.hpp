// A fit once more with one effect more, or one less: from the states and values that the last one left.
#pragma once
#include <optional>

#include "bench/sysid/diagnose/screening.hpp"

namespace rotorloop::diagnose {

// A fit with one effect more, begun: values and states have settled with the priors' parameters held and the noise as given.
struct Refit {
  identify::Identification fit;
  std::optional<double> cost_held;  // there; none without priors
};
// `estimate`: of the candidate's parameters, about their neutral values; where the new fit starts. `noise`: of each flight, likewise.
Refit begin_refit(const identify::Identification& last, const Candidate& candidate, const Eigen::VectorXd& estimate,
                  const std::vector<estimate::NoiseModel>& noise, const estimate::FitOptions& options);
void finish_refit(Refit& refit, const estimate::FitOptions& options);
// The same cost without the effect.
std::optional<double> cost_held(const identify::Identification& last, const std::vector<estimate::NoiseModel>& noise,
                                const estimate::FitOptions& options);

identify::Identification refit_without(const identify::Identification& last, const Candidate& candidate,
                                       const estimate::FitOptions& options);

// The same model with the priors' parameters at their most likely values, and all else fitted: states, noise, parameters without a prior.
// Here what the model lacks stands in the residuals as it is; in the fit itself those parameters have moved to hide as much of it as they
// can. The problem keeps its priors as they were. Without priors: the same fit.
identify::Identification at_priors(const identify::Identification& fitted, const estimate::FitOptions& options);

// The same fit, its problem pointing into its own flights.
identify::Identification copy_of(const identify::Identification& fitted);

// The candidate's parameters in a fit that has it.
std::vector<int> parameters_of(const Candidate& candidate, const host::TermList& terms);

}  // namespace rotorloop::diagnose
