// The likelihood of all flights as a quadratic function of the model's free parameters and of terms that it does not hold, about the
// fit: information and score, in sum, per flight and per block of time, with the states eliminated. What a term would gain, its
// estimate, what it is confounded with and whether it predicts blocks that did not estimate it, is then linear algebra.
//   S̃ = S_γγ - S_γθ S_θθ⁻¹ S_θγ,  s̃ = s_γ - S_γθ S_θθ⁻¹ s_θ,  γ̂ = -S̃⁻¹ s̃,  χ² = s̃ᵀ S̃⁻¹ s̃
// Residuals of real flights are correlated, so χ² is no test. Each block's contribution to the reduced score, with the estimated
// effect taken out (u_b = c_b + I_b γ̂, else its own size would count as scatter), gives V, and with it a Wald statistic that holds.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace rotorloop::diagnose {

using ColumnSet = std::vector<Eigen::Index>;

struct ScoreTable {
  using Index = Eigen::Index;
  // Columns: the model's free numbers first, then those of terms.
  Index base = 0;
  Eigen::MatrixXd information;  // with what was known before
  Eigen::VectorXd score;

  struct Block {
    std::size_t flight = 0;
    double from_s = 0.0, to_s = 0.0;
    std::vector<Index> at;        // columns of the table that this flight knows
    Eigen::MatrixXd information;  // over `at`, of the data alone
    Eigen::VectorXd score;
  };
  std::vector<Block> blocks;
  std::vector<int> fold;  // of each block, for cross-validation
  std::vector<ColumnSet>
      sums_held;              // columns of which only the differences count (bench/sysid/identify/gauge.hpp): a group moves along these
  double measurements = 0.0;  // numbers read, for the information criterion
};

// Orthonormal directions in which a group may move: those that leave the sums held as they are.
Eigen::MatrixXd directions(const std::vector<ColumnSet>& sums_held, const ColumnSet& group);

// What the data say of the columns `group` beside the columns `model`.
struct GroupTest {
  Eigen::VectorXd estimate;    // γ̂, about the fit
  Eigen::MatrixXd covariance;  // the larger of classical and block-robust, direction by direction
  int degrees = 0;             // directions that the data determine at all
  double chi2 = 0.0;           // classical
  double wald = 0.0, p = 1.0;  // robust F statistic and its chance
  double blocks = 0.0;         // effective number of blocks that know of it
  double gain = 0.0;           // Δ log-likelihood, ½ χ², deflated by the scatter of the blocks
  double inflation = 1.0;      // mean variance of blocks over the classical one, at least 1
  double open = 0.0;           // share of its own information that is left beside the model, 0 to 1
};
GroupTest test_group(const ScoreTable& table, const ColumnSet& model, const ColumnSet& group);

// Information that the data hold of a group along `change` of its numbers, beside the columns `model`: twice the Δ log-likelihood that such
// a change is worth.
double information_along(const ScoreTable& table, const ColumnSet& model, const ColumnSet& group, const Eigen::VectorXd& change);

// Δ log-likelihood on folds that did not estimate the group, over what the model alone does there; deflated by `inflation`.
double cross_validated_gain(const ScoreTable& table, const ColumnSet& model, const ColumnSet& group, double inflation);

// Optimism of a fit: by how much the cost of folds rises when they have no part in the estimate of the columns, in log units. The log
// likelihood of the fit less this is what it predicts of stretches left out; where blocks scatter by more than their noise it takes more
// than a criterion that counts numbers.
double optimism(const ScoreTable& table, const ColumnSet& columns);

// Heterogeneity: how much an effect's size varies over the blocks.
struct Heterogeneity {
  // Standard deviation of the group's size between blocks over that size: what the scatter of the block scores about it says beyond the
  // noise, by the method of moments (DerSimonian and Laird, Meta-analysis in clinical trials, 1986). 0: the same everywhere, as far as
  // the data show.
  double variation = 0.0;
  double scatter = 1.0;  // that scatter over the one that noise gives, as a variance
};
// `size`: of the group, γ about neutral.
Heterogeneity heterogeneity(const ScoreTable& table, const ColumnSet& model, const ColumnSet& group, const Eigen::VectorXd& size);

// Canonical correlations of two groups of columns, after the model took its share: the largest first, as many as the smaller group has
// directions; none where one of them has none.
Eigen::VectorXd canonical_correlations(const ScoreTable& table, const ColumnSet& model, const ColumnSet& a, const ColumnSet& b);
// The largest of them; 0 for none.
double confounding(const ScoreTable& table, const ColumnSet& model, const ColumnSet& a, const ColumnSet& b);

ColumnSet with(ColumnSet a, const ColumnSet& b);
ColumnSet base_columns(const ScoreTable& table);

}  // namespace rotorloop::diagnose
