// The linear algebra of screening on regressions whose answers are known: estimates, chance, correlated residuals, aliases, folds.
#include "bench/sysid/diagnose/score_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "test/unit/bench/sysid/diagnose/made_up_regression.hpp"

namespace rotorloop::diagnose {
namespace {

using namespace made_up;

TEST(ScoreTable, EstimateAndUncertaintyAreThoseOfLeastSquares) {
  Regression r{{noise(1, 1), noise(1, 2)}, noise(1, 3)};
  for (std::size_t k = 0; k < kSamples; ++k) r.y[k] += 0.5 * r.columns[1][k];
  const GroupTest t = test_group(r.table(), {0}, {1});
  EXPECT_NEAR(t.estimate[0], 0.5, 4.0 * std::sqrt(t.covariance(0, 0)));
  EXPECT_NEAR(std::sqrt(t.covariance(0, 0)), 1.0 / std::sqrt(static_cast<double>(kSamples)), 0.01);
  EXPECT_LT(t.p, 1e-9);
  EXPECT_GT(t.gain, 0.7 * 0.5 * 0.25 * kSamples);
}

TEST(ScoreTable, WhatTheModelAlreadyHasIsNotTold) {
  Regression r{{noise(2, 1), {}}, noise(2, 3)};
  r.columns[1] = r.columns[0];
  const GroupTest t = test_group(r.table(), {0}, {1});
  EXPECT_EQ(t.degrees, 0);
  EXPECT_EQ(t.gain, 0.0);
}

// Absent effects under correlated residuals: at a nominal 1 % the classical test cries wolf, the block-robust one hardly does.
TEST(ScoreTable, CorrelatedResidualsRaiseNoFalseAlarms) {
  int classical = 0, robust = 0;
  constexpr int kTrials = 200;
  for (int i = 0; i < kTrials; ++i) {
    const auto seed = static_cast<std::uint64_t>(100 + i);
    const Regression r{{noise(seed, 1), coloured(seed, 2, 0.9)}, coloured(seed, 3, 0.9)};
    const GroupTest t = test_group(r.table(), {0}, {1});
    classical += t.chi2 > 6.635;
    robust += t.p < 0.01;
  }
  EXPECT_GT(classical, kTrials / 4);
  EXPECT_LE(robust, kTrials / 25);
}

TEST(ScoreTable, AnEffectOfOneBlockOnlyDoesNotHoldOnOthers) {
  Regression r{{noise(3, 1), noise(3, 2)}, noise(3, 3)};
  for (std::size_t k = 0; k < 50; ++k) r.y[k] += 3.0 * r.columns[1][k];
  const ScoreTable t = r.table();
  const GroupTest g = test_group(t, {0}, {1});
  EXPECT_LT(cross_validated_gain(t, {0}, {1}, g.inflation), 0.0);
}

TEST(ScoreTable, ARealEffectHoldsOnBlocksThatDidNotEstimateIt) {
  Regression r{{noise(4, 1), noise(4, 2)}, noise(4, 3)};
  for (std::size_t k = 0; k < kSamples; ++k) r.y[k] += 0.3 * r.columns[1][k];
  const ScoreTable t = r.table();
  const GroupTest g = test_group(t, {0}, {1});
  EXPECT_GT(cross_validated_gain(t, {0}, {1}, g.inflation), 0.8 * g.gain);
}

// Sizes of 0.4 (1 + e), e of standard deviation `spread` and drawn for each block; what the table says of their spread.
double estimated_spread(std::uint64_t seed, double spread) {
  Regression r{{noise(seed, 1), noise(seed, 2)}, noise(seed, 3)};
  const std::vector<double> of_block = noise(seed, 4);
  for (std::size_t k = 0; k < kSamples; ++k) r.y[k] += 0.4 * (1.0 + spread * of_block[k / r.per_block]) * r.columns[1][k];
  const ScoreTable t = r.table();
  return heterogeneity(t, {0}, {1}, test_group(t, {0}, {1}).estimate).variation;
}
TEST(ScoreTable, TheSizeOfAnEffectThatIsTheSameEverywhereDoesNotVary) {
  for (std::uint64_t seed = 10; seed < 20; ++seed) EXPECT_LT(estimated_spread(seed, 0.0), 0.3) << seed;
}
TEST(ScoreTable, HowMuchASizeVariesFromBlockToBlockIsTold) {
  double sum = 0.0;
  constexpr int kTrials = 20;
  for (int i = 0; i < kTrials; ++i) sum += estimated_spread(30 + static_cast<std::uint64_t>(i), 1.0) / kTrials;
  EXPECT_NEAR(sum, 1.0, 0.25);
}
TEST(ScoreTable, AnEffectOfEveryFifthBlockVariesByTwiceItself) {
  Regression r{{noise(6, 1), noise(6, 2)}, noise(6, 3)};
  for (std::size_t k = 0; k < kSamples; ++k) r.y[k] += (k / r.per_block) % 5 == 0 ? 2.0 * r.columns[1][k] : 0.0;
  const ScoreTable t = r.table();
  const Heterogeneity e = heterogeneity(t, {0}, {1}, test_group(t, {0}, {1}).estimate);
  EXPECT_NEAR(e.variation, 2.0, 0.5);
  EXPECT_GT(e.scatter, 10.0);
}

TEST(ScoreTable, ASmallEffectBesideNoiseThatWandersScattersLittleThoughItsSizeIsNotDeterminedEverywhere) {
  Regression r{{noise(8, 1), noise(8, 2)}, coloured(8, 3, 0.5)};
  r.columns[1] = coloured(8, 2, 0.5);
  for (std::size_t k = 0; k < kSamples; ++k) r.y[k] += 0.1 * r.columns[1][k];
  const ScoreTable t = r.table();
  EXPECT_LT(heterogeneity(t, {0}, {1}, test_group(t, {0}, {1}).estimate).scatter, 4.0);
}

// A number fitted to two folds of information 100 each, whose scores differ by twice `score` and sum to nothing.
ScoreTable fitted_to_two_folds_that_differ(double score) {
  ScoreTable t;
  t.base = 1;
  t.information = Eigen::MatrixXd::Constant(1, 1, 200.0);
  t.score = Eigen::VectorXd::Zero(1);
  for (const double s : {score, -score})
    t.blocks.push_back({0, 0.0, 1.0, {0}, Eigen::MatrixXd::Constant(1, 1, 100.0), Eigen::VectorXd::Constant(1, s)});
  t.fold = {0, 1};
  return t;
}

TEST(ScoreTable, AFitToStretchesThatDisagreeByThreeStandardErrorsIsOptimisticByNineTimesAsMuchAsByOne) {
  EXPECT_NEAR(optimism(fitted_to_two_folds_that_differ(0.0), {0}), 0.0, 1e-9);
  EXPECT_NEAR(optimism(fitted_to_two_folds_that_differ(10.0), {0}), 3.0, 1e-9);
  EXPECT_NEAR(optimism(fitted_to_two_folds_that_differ(30.0), {0}), 27.0, 1e-9);
}

TEST(ScoreTable, ConfoundingOfAliasesIsOneAndOfIndependentColumnsNothing) {
  Regression r{{noise(5, 1), noise(5, 2), {}, noise(5, 4)}, noise(5, 3)};
  r.columns[2] = r.columns[1];
  for (std::size_t k = 0; k < kSamples; ++k) r.columns[2][k] = -2.0 * r.columns[1][k] + 0.5 * r.columns[0][k];
  const ScoreTable t = r.table();
  EXPECT_NEAR(confounding(t, {0}, {1}, {2}), 1.0, 1e-6);
  EXPECT_LT(confounding(t, {0}, {1}, {3}), 0.1);
}

}  // namespace
}  // namespace rotorloop::diagnose
