// What a fit is given and what it leaves: free parameters with what is known of them, flights, options; estimates, states, noise.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/estimate/chain.hpp"
#include "bench/sysid/estimate/noise_search.hpp"
#include "bench/sysid/estimate/stop_fit.hpp"

namespace rotorloop::estimate {

struct FreeParameter {
  int parameter;            // enum Parameter, or kCoreParameters + place in the term list
  bool per_flight = false;  // one value for each flight
  double prior_u = 0.0;     // standard deviation of a Gaussian about the start value; 0: none
};

// What is known of several shared parameters together, before any flight: ½ (θ - mean)ᵀ information (θ - mean) joins the cost.
// Parameters that the fit does not free count as known.
struct JointPrior {
  std::vector<int> parameters;
  Eigen::VectorXd mean;
  Eigen::MatrixXd information;
  // By how much the flights' own information overstates what they know (their blocks scatter more than the noise says): the prior counts by
  // so much more, lest a model error outvote it.
  double weight = 1.0;
  bool weak = false;  // a guess: it keeps what the flights leave open from running away, and is nothing to hold a parameter at
};

struct FitOptions {
  int max_iterations = 40;
  double tolerance = 1e-4;    // Newton decrement (predicted fall of the cost) that ends the iteration
  double robust_scale = 0.0;  // see SweepOptions
  double block_s = 1.0;       // for robust standard errors
  bool innovations = false;   // of the poses, at the end
  int threads = 1;            // over flights; the result does not depend on it
  NoiseFit noise;
  StopFit stop = {};  // asked: the fit ends at its next iteration, not converged
};

struct FitProblem {
  ModelValues start;
  std::vector<FreeParameter> free;
  std::vector<const GridFlight*> flights;
  NoiseModel noise;                      // start value for all flights …
  std::vector<NoiseModel> flight_noise;  // … or one for each
  std::vector<std::vector<double>>
      flight_start;  // optional: start values of each flight (as ModelValues::values), for parameters per flight
  std::vector<JointPrior> priors = {};
  // Optional: first guess of the states of each flight, as an earlier fit left them.
  std::vector<std::vector<BodyState>> states = {};
};

// One estimated number.
struct Estimate {
  int parameter = 0;
  int flight = -1;  // -1: shared
  double value = 0.0;
  double u = 0.0;            // standard error from the information matrix
  double u_robust = 0.0;     // from the scatter of block scores: holds when residuals are correlated
  double prior_share = 0.0;  // of the information: above one half the data did not determine it
  double prior_z = 0.0;      // by how many of its own prior's standard deviations the data moved it; 0 without one
  bool at_bound = false;     // stopped at the end of its range (ParameterInfo): the data ask for more; u is that of a free one
};

struct Fit {
  std::vector<Estimate> estimates;
  Eigen::MatrixXd covariance, robust_covariance;  // in the order of estimates
  Eigen::MatrixXd information;                    // of the data, without priors
  std::vector<ModelValues> values;                // of each flight
  std::vector<NoiseModel> noise;                  // of each flight
  std::vector<std::vector<BodyState>> states;     // of each flight
  std::vector<Reduced> reduced;                   // of each flight at the optimum, in its own columns (free parameters in order)
  double cost = 0.0;
  double degrees_of_freedom = 0.0;  // residuals minus states minus parameters
  double log_likelihood = 0.0;      // marginal over the states (Laplace), constants left out
  std::size_t blocks = 0;           // of residuals, whose scatter the robust covariance is made of
  int iterations = 0, noise_rounds = 0;
  bool converged = false;
  bool noise_settled = false;  // or kept as given; false: the rounds ran out before every figure came to rest

  const Estimate* find(int parameter, int flight = -1) const;
};

struct FitProgress {
  int iteration = 0;
  double cost = 0.0, decrement = 0.0;
  int noise_round = 0;
};

std::string estimate_name(const Estimate& e, const FitProblem& problem);  // "k_1", or "Δx (vertical)" for one of a flight

}  // namespace rotorloop::estimate
