// Linear least squares whose uncertainty holds when neighbouring points err together: the points come in blocks, and the scatter of
// the blocks' scores, not that of single residuals, says what the data determine.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace rotorloop {

struct BlockFit {
  Eigen::VectorXd c;           // coefficients, one for each column
  Eigen::MatrixXd covariance;  // from the blocks
  Eigen::VectorXd u;           // the larger of the classical standard error and that from the blocks
  Eigen::VectorXd residual;    // y - X c
  double rms = 0.0;
  double r2 = 0.0;  // 1 - Σ residual² / Σ (y - mean)²
  std::size_t blocks = 0;
};

// `block` numbers the points' blocks, in any order. Throws Error (data_quality) for fewer points than columns + 1.
BlockFit fit_in_blocks(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const std::vector<int>& block);

// Errors y - X c of each block by coefficients from the others; a model that only describes what it was fitted to does badly here.
Eigen::VectorXd left_out_errors(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const std::vector<int>& block);

// Relative fall of the rms from errors `before` to `after`, with its 95 % interval from resampling blocks.
struct RmsReduction {
  double value = 0.0, low = 0.0, high = 0.0;
};
RmsReduction rms_reduction(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const std::vector<int>& block, std::uint64_t seed);

double rms_of(const Eigen::VectorXd& e);

}  // namespace rotorloop
