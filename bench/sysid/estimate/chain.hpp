// Elimination of one flight's states from the normal equations: block-tridiagonal states, parameters as the arrow. One forward sweep
// without fill gives the reduced system of the parameters, the log-determinant of the states' information, the cost, scores per
// block of time, and innovations; a backward sweep gives the states' steps.
// With A = ∂r/∂x_k, B = ∂r/∂x_{k+1}, J = ∂r/∂θ, and D, E, C the blocks of the normal matrix:
//   L Lᵀ = D - Y₋ᵀY₋,  Y = L⁻¹E,  [Z y] = L⁻¹([C g] - Y₋ᵀ[Z y]₋),  S = ΣJᵀJ - ΣZᵀZ,  s = ΣJᵀr - ΣZᵀy
//   δx = -L⁻ᵀ(y + Z δθ + Y δx₊)
// (a Kalman smoother in information form; Bell 1994: iterated, it is Gauss-Newton).
#pragma once
#include <vector>

#include "bench/sysid/estimate/linear_rows.hpp"
#include "bench/sysid/estimate/residuals.hpp"

namespace rotorloop::estimate {

// Increment of the reduced system over a block of time, with the state at the block's end known from its past only: these are
// uncorrelated between blocks when the model is right.
struct ScoreBlock {
  double from_s = 0.0, to_s = 0.0;
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
};

// Measurement minus its prediction from the past, whitened by the predicted covariance: white and of unit variance when the model is right.
struct Innovation {
  double t_s = 0.0;
  Eigen::Matrix<double, 6, 1> value;
  // The predicted covariance L Lᵀ, in units of the measurement's own variances: lower triangle L.
  Eigen::Matrix<double, 6, 6> root = Eigen::Matrix<double, 6, 6>::Identity();
};

struct Reduced {
  Eigen::MatrixXd information;          // S, columns x columns
  Eigen::VectorXd score;                // s; the Newton step of the parameters is -S⁻¹s
  double cost = 0.0;                    // ½ Σ r² (robust: ½ Σ ρ)
  double predicted_cost = 0.0;          // after the states' own step, parameters kept
  double log_det_states = 0.0;          // log|H_xx|
  std::size_t residuals = 0;            // numbers
  std::vector<ScoreBlock> blocks;       // when asked for
  std::vector<Innovation> innovations;  // of the poses, when asked for
};

struct SweepOptions {
  double damping = 0.0;      // Levenberg-Marquardt, on the diagonal of D
  bool keep_factors = true;  // for the backward sweeps
  bool keep_rows = false;    // linearised steps and measurements, some 4 kB a step, for rows_here()
  double block_s = 0.0;      // length of score blocks; 0: none
  bool innovations = false;
  double robust_scale = 0.0;  // Cauchy loss on each pose, in standard deviations of its six numbers together; 0: squares
};

class Chain {
 public:
  // `states` is kept by reference and moved by apply().
  Chain(const GridFlight& flight, std::vector<BodyState>& states, const std::vector<BodyState>& guess);

  Reduced sweep(const Residuals& residuals, const SweepOptions& options);
  // Steps of the states for a step of the parameters, from the factors of the last sweep; scaled by `share`.
  void apply(const Eigen::VectorXd& parameter_step, double share);
  double cost(const Residuals& residuals, double robust_scale) const;
  void move(const std::vector<StateError>& by);
  // The rows kept by the last sweep: slopes of there, residuals of here.
  const LinearRows& rows_here(const Residuals& residuals);

 private:
  struct Factor {
    Eigen::Matrix<double, 12, 12> l, y;  // L (lower triangle), Y
  };

  const GridFlight& flight_;
  std::vector<BodyState>& states_;
  const std::vector<BodyState>& guess_;
  std::vector<Factor> factors_;
  LinearRows rows_;            // empty unless they are kept
  std::vector<double> arrow_;  // [Z y] of each node, 12 x (columns + 1)
  Eigen::Index columns_ = 0;
};

}  // namespace rotorloop::estimate
