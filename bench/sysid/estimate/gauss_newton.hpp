// Gauss-Newton over the parameters and all states of the flights: linearise every flight and eliminate its states (chain.hpp), solve
// the reduced normal equations for the parameters, substitute back into the states, and shorten or damp a step that does not lower
// the cost: the parameters' first, by a trust region whose size follows the ratio of what a step gains to what it promises, while the
// states go all the way to where they are best with them; the states' own step only where no step of the parameters helps. The noise is
// estimated between two steps, once the states are near their best values.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "bench/sysid/estimate/fit_layout.hpp"

namespace rotorloop::estimate {

// Derivation. Measurements and the error of the model in a step are independent and normal. Up to terms of the noise alone, the negative
// log likelihood of all states x and parameters θ is then half a sum of squares of residuals r, each over its standard deviation (a prior
// of a parameter is one more residual):
//   c(x, θ) = ½ Σ r_i(x, θ)²,   r(x + δx, θ + δθ) ≈ r + A δx + J δθ
// The minimum of the linearised cost solves the normal equations, which leave out the second derivatives of r: these stand beside residuals
// that are small and of either sign (Nocedal, Wright, Numerical Optimization, 2006, chapter 10):
//   AᵀA δx + AᵀJ δθ = -Aᵀr,   JᵀA δx + JᵀJ δθ = -Jᵀr
// AᵀA couples only states that follow each other, so solving the first for δx is cheap, and leaves a small system for the parameters:
//   S δθ = -s,   S = JᵀJ - JᵀA (AᵀA)⁻¹ AᵀJ,   s = Jᵀr - JᵀA (AᵀA)⁻¹ Aᵀr
// S is the information about θ that is left once the states have taken their part; its inverse is the covariance of the estimates. A step
// promises the fall ½ rᵀA (AᵀA)⁻¹ Aᵀr - sᵀδθ - ½ δθᵀS δθ of the cost. Damping multiplies the diagonal of S by 1 + λ (Marquardt 1963), and λ
// follows the ratio of what a step gained to what it promised (Fletcher 1971).
class GaussNewton {
 public:
  GaussNewton(const FitProblem& problem, const FitOptions& options);
  GaussNewton(const GaussNewton&) = delete;  // the chains refer to the states
  GaussNewton& operator=(const GaussNewton&) = delete;

  void iterate(const std::function<void(const FitProgress&)>& progress);
  void linearise_for_results();  // undamped, where the iteration ended

  const Layout& layout() const { return layout_; }
  const Priors& priors() const { return priors_; }
  const std::vector<std::string>& names() const { return names_; }  // of the estimates
  const Eigen::VectorXd& theta() const { return theta_; }
  const Eigen::MatrixXd& information() const { return information_; }  // of the flights
  Eigen::MatrixXd information_with_priors() const { return information_ + priors_.information(); }
  double cost() const { return cost_; }
  bool observable_at_start() const { return observable_at_start_; }  // every direction of the parameters
  Fit& fit() { return fit_; }                                        // values, noise, states and reduced systems of the flights

 private:
  void linearise(double damping, bool innovations = false);
  void sum_normal_equations();
  void move_to(const Eigen::VectorXd& theta, const Eigen::VectorXd& step, double share);
  void move_back(const std::vector<std::vector<BodyState>>& states);
  double cost_here(const Eigen::VectorXd& theta) const;
  Eigen::VectorXd newton_step() const;
  double decrement(const Eigen::VectorXd& step) const;  // fall of the cost that the linear model promises
  bool undamped() const { return damping_ == 0.0 && state_damping_ == 0.0; }
  void count_stalls();
  bool at_optimum(double decrement) const;
  bool ready_for_noise(double decrement) const;
  bool descend(Eigen::VectorXd step, double decrement);
  void adapt(double gained, double promised, bool at_once);
  void estimate_noise();
  bool likelihood_settled(double decrement);
  Eigen::VectorXd score_with_priors() const { return score_ + priors_.score(theta_); }

  const FitProblem& problem_;
  const FitOptions& options_;
  Layout layout_;
  Priors priors_;
  std::vector<std::string> names_;
  bool exact_slopes_;
  double near_optimum_;  // of the cost: a decrement below it leaves residuals that say how large the noise is

  Fit fit_;
  std::vector<std::vector<BodyState>> guess_;
  std::vector<Chain> chains_;
  Eigen::VectorXd theta_;
  std::vector<NoiseModel> noise_limits_;  // of each flight, no figure of its measurements above it

  // The reduced normal equations at the last sweep.
  Eigen::MatrixXd information_;
  Eigen::VectorXd score_;
  double cost_ = 0.0, states_gain_ = 0.0;  // states_gain_: fall of the cost by the states' own step
  bool undamped_here_ = false;             // the last sweep was undamped, and nothing moved since

  double damping_ = 0.0, state_damping_ = 0.0;  // Levenberg-Marquardt, of the parameters' reduced equations and of the states'
  int stalled_ = 0;                             // iterations in turn that lowered the cost by nothing that matters
  double cost_before_;                          // the lowest so far with this noise; infinite when there is none
  // Slopes that are not exact can lead to and fro between two points for ever: one step whose cost was not looked at and that did not
  // lower it ends the trust in such steps.
  bool trust_small_steps_ = true;
  double cost_before_unchecked_;  // … with this noise; infinite when the last step was checked
  bool noise_done_;               // settled, kept as given, or out of rounds
  // The likelihood before each round of the noise, and the noise that it was highest with.
  double best_likelihood_;
  int rounds_since_best_ = 0;
  std::vector<NoiseModel> best_noise_;
  bool observable_at_start_ = true;
};

}  // namespace rotorloop::estimate
