// Do the flights agree on one vehicle? At the joint optimum each flight's reduced system says where it would move the shared
// parameters by itself; under one vehicle the weighted sum of these moves is χ² distributed (sysid: between-flight homogeneity).
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/estimate/estimator.hpp"

namespace rotorloop::identify {

// One shared parameter between the flights: with the information of each flight about it, all other parameters free.
struct ParameterHomogeneity {
  int parameter = 0;
  std::vector<double> value, u;  // of each flight by itself, to first order; u infinite: it has less than 4 % of the information of all
  double chi2 = 0.0, degrees = 0.0, p = 1.0;
  bool moved = false;  // p below 1 % shared among the parameters
};
struct Homogeneity {
  double chi2 = 0.0, degrees = 0.0, p = 1.0;  // all shared parameters together
  std::vector<ParameterHomogeneity> parameters;
};

// Σ_f (θ_f - θ)ᵀ S_f (θ_f - θ) with θ_f - θ = -S_f⁻¹ s_f, that is Σ s_fᵀ S_f⁻¹ s_f, over the directions in which a flight holds at least 4
// % of the joint information: elsewhere the joint fit hardly listens to it, and its own estimate is biased (the states' share of the
// likelihood, log|H_xx|, moves a maximum that is nearly flat). In such directions with share λ the expected square is 1 - λ; their sum is
// the number of degrees. Per-flight parameters are eliminated first. `inflation`: by which robust variances exceed classical ones;
// divides χ², since correlated residuals make flights differ by more than S says; 1: none. A single parameter has its own ratio. Empty for
// a single flight.
Homogeneity homogeneity_of(const estimate::FitProblem& problem, const estimate::Fit& fit, double inflation = 1.0);

}  // namespace rotorloop::identify
