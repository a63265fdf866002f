// The fit: maximum likelihood of parameters and all states over any number of flights (the paper's eq. 10), by Gauss-Newton with
// the states eliminated flight by flight, and of the noise by EM in the same sweeps.
#pragma once
#include <functional>

#include "bench/sysid/estimate/fit_problem.hpp"
#include "bench/sysid/estimate/open_directions.hpp"

namespace rotorloop::estimate {

// Throws Error (data_quality) when the data leave directions open, naming them, or when a flight cannot be fitted at all.
Fit fit(const FitProblem& problem, const FitOptions& options = {}, const std::function<void(const FitProgress&)>& progress = {});

}  // namespace rotorloop::estimate
