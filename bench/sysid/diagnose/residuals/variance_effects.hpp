// Effects that change how much the residuals scatter, and not their mean: late stamps that jitter, gusts, thrust that wanders in the
// vortex ring. Each has a score: the slope of the likelihood by its variance at zero, a quadratic form in the smoothed residuals less
// its mean under the model. Mean and information come from residuals that noise of the fitted figures gives (residual_series.hpp), the
// significance from the scatter of blocks of time, after the noise figures of each flight have taken their share.
#pragma once
#include <span>

#include "bench/sysid/diagnose/decision_rules.hpp"
#include "bench/sysid/diagnose/residuals/residual_series.hpp"

namespace rotorloop::diagnose {

// A way in which variance may depend on the flight. Sum over directions d and samples k, l of a block:
//   ½ Σ ρ^|k-l| (g_dk·r_k)(g_dl·r_l), ρ = exp(-step/tau), tau = 0: k = l only.
struct VarianceKind {
  enum class Rows { steps, poses, accels };
  std::string id;    // effects/catalogue.toml; empty: no effect of the catalogue, a rival that keeps others from its place
  std::string what;  // "force noise that grows with speed"
  std::string parameter, unit;
  Rows rows = Rows::steps;
  double tau_s = 0.0;
  // Directions of one row (12, 6 or 3 numbers long), whitened, for a standard deviation of one unit.
  std::vector<std::vector<Eigen::VectorXf>> directions;  // [row of WhitenedResiduals][direction]
  std::string untested;                                  // why it could not be tested; empty: it was
};
std::vector<VarianceKind> variance_kinds(const ResidualSeries& series);

struct VarianceEffect {
  std::string id, what, parameter, unit;
  double size = 0.0, u = 0.0;  // standard deviation by one step from zero: good when small, an order of magnitude when large
  double t = 0.0;              // robust statistic; large and positive: there
  double p = 1.0, p_holm = 1.0;
  bool found = false;                                   // by forward selection (Holm)
  std::vector<std::pair<std::string, double>> aliases;  // much alike by the correlation of their scores
  std::string untested;
};
struct VarianceResult {
  std::vector<VarianceEffect> effects;  // found first, in the order found; then by p
  std::size_t blocks = 0;
};

struct VarianceOptions {
  double block_s = 2.0;
  Criteria criteria = {};
  int most = 3;
};
VarianceResult variance_effects(const ResidualSeries& series, std::span<const VarianceKind> kinds, const VarianceOptions& options = {});

// The statistics alone: scores of each block, less their mean under the model; first column the flight's, then those of simulated
// residuals.
struct BlockScores {
  Eigen::MatrixXd value;  // blocks x (1 + simulated)
};
struct ScoreTest {
  double gamma = 0.0, u_gamma = 0.0;  // variance by one step from zero
  double gain = 0.0;                  // of the log likelihood, by the same step
  double t = 0.0, p = 1.0;
};
ScoreTest score_test(const BlockScores& scores, std::span<const std::size_t> flight_of_block);

}  // namespace rotorloop::diagnose
