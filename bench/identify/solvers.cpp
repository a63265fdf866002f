#include "bench/identify/solvers.hpp"

#include "bench/identify/ceres_solver.hpp"

namespace rotorloop::bench {

Solver ceres_solver() {
  return [](const FitProblem& problem, const FitOptions& options, const std::function<void(const FitProgress&)>& progress) {
    Fit out = fit(problem, options, progress);
    FitProblem again = problem;
    again.flight_noise = out.noise;
    FitOptions fixed = options;
    fixed.noise.rounds = 0;
    const Fit theirs = fit_with_ceres(again, fixed, progress);
    for (std::size_t i = 0; i < out.estimates.size(); ++i) {
      out.estimates[i].value = theirs.estimates[i].value;
      out.estimates[i].u = theirs.estimates[i].u;
      out.estimates[i].prior_share = theirs.estimates[i].prior_share;
    }
    out.covariance = theirs.covariance;
    out.values = theirs.values;
    out.states = theirs.states;
    out.cost = theirs.cost;
    out.iterations = theirs.iterations;
    out.converged = out.converged && theirs.converged;
    return out;
  };
}

}  // namespace rotorloop::bench
