// The fit of estimator.hpp by Ceres instead of the own elimination: the independent answer to the same problem. Slower, and it needs
// several times the memory; a test and `rotorloop identify --solver ceres` hold the two together.
#pragma once
#include <functional>

#include "bench/sysid/estimate/estimator.hpp"

namespace rotorloop::estimate {

// The same problem, the same cost, the same answer as fit(): Levenberg-Marquardt with SPARSE_NORMAL_CHOLESKY, then
// ceres::Covariance (sparse QR of the whole Jacobian) for the parameters. Of FitOptions it heeds max_iterations, tolerance and
// robust_scale; one thread.
// Fills estimates, covariance, information, values, noise, states, cost, degrees_of_freedom, iterations, converged. What the own sweep
// alone gives is not there: u_robust, robust_covariance and log_likelihood are NaN, reduced is empty.
// Throws Error: usage when EM for the noise is asked for (give the noise of a fit() instead), data_quality when Ceres cannot go on
// or finds the Jacobian rank deficient (fit() then names the directions).
Fit fit_with_ceres(const FitProblem& problem, const FitOptions& options = {}, const std::function<void(const FitProgress&)>& progress = {});

}  // namespace rotorloop::estimate
