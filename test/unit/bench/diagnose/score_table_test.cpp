// The linear algebra of screening on regressions whose answers are known: estimates, chance, correlated residuals, twins, folds.
#include "bench/diagnose/score_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "bench/diagnose/statistics.hpp"
#include "sim/world/random.hpp"

namespace rotorloop::bench {
namespace {

using Index = ScoreTable::Index;

// y = Σ columns θ + noise of unit variance, in blocks of `per_block` samples; the table stands at θ = 0.
struct Regression {
  std::vector<std::vector<double>> columns;
  std::vector<double> y;
  std::size_t base = 1, per_block = 50;

  ScoreTable table() const {
    const auto n = static_cast<Index>(columns.size());
    ScoreTable t;
    t.base = static_cast<Index>(base);
    t.information = Eigen::MatrixXd::Zero(n, n);
    t.score = Eigen::VectorXd::Zero(n);
    t.readings = static_cast<double>(y.size());
    std::vector<Index> all;
    for (Index i = 0; i < n; ++i) all.push_back(i);
    for (std::size_t from = 0; from + per_block <= y.size(); from += per_block) {
      ScoreTable::Block b{0,   static_cast<double>(from),   static_cast<double>(from + per_block),
                          all, Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
      for (std::size_t k = from; k < from + per_block; ++k) {
        Eigen::VectorXd x(n);
        for (Index i = 0; i < n; ++i) x[i] = columns[static_cast<std::size_t>(i)][k];
        b.information += x * x.transpose();
        b.score -= x * y[k];
      }
      t.information += b.information;
      t.score += b.score;
      t.fold.push_back(static_cast<int>(t.blocks.size() / 4 % 5));
      t.blocks.push_back(std::move(b));
    }
    return t;
  }
};

constexpr std::size_t kSamples = 3000;

std::vector<double> noise(std::uint64_t seed, std::uint64_t module) {
  const sim::RandomStream random(seed, module);
  std::vector<double> out(kSamples);
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = random.gaussian(k);
  return out;
}
// First-order process of unit variance that remembers `memory` of its last value.
std::vector<double> coloured(std::uint64_t seed, std::uint64_t module, double memory) {
  std::vector<double> out = noise(seed, module);
  for (std::size_t k = 1; k < out.size(); ++k) out[k] = memory * out[k - 1] + std::sqrt(1.0 - memory * memory) * out[k];
  return out;
}

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

TEST(ScoreTable, ConfoundingOfTwinsIsOneAndOfStrangersNothing) {
  Regression r{{noise(5, 1), noise(5, 2), {}, noise(5, 4)}, noise(5, 3)};
  r.columns[2] = r.columns[1];
  for (std::size_t k = 0; k < kSamples; ++k) r.columns[2][k] = -2.0 * r.columns[1][k] + 0.5 * r.columns[0][k];
  const ScoreTable t = r.table();
  EXPECT_NEAR(confounding(t, {0}, {1}, {2}), 1.0, 1e-6);
  EXPECT_LT(confounding(t, {0}, {1}, {3}), 0.1);
}

// Percentiles of F(d1, d2) as tabulated (Abramowitz and Stegun, table 26.9).
TEST(Statistics, TailOfTheFDistribution) {
  EXPECT_NEAR(f_tail(4.9646, 1.0, 10.0), 0.05, 1e-5);
  EXPECT_NEAR(f_tail(4.1028, 2.0, 10.0), 0.05, 1e-5);
  EXPECT_NEAR(f_tail(6.6349, 1.0, 1e7), 0.01, 1e-5);
  EXPECT_EQ(f_tail(0.0, 3.0, 20.0), 1.0);
}

// The example of Holm's step-down: 0.01, 0.04, 0.03, 0.005 become 0.03, 0.06, 0.06, 0.02.
TEST(Statistics, HolmStepsDown) {
  const std::vector<double> p{0.01, 0.04, 0.03, 0.005};
  const std::vector<double> adjusted = holm(p);
  EXPECT_NEAR(adjusted[0], 0.03, 1e-12);
  EXPECT_NEAR(adjusted[1], 0.06, 1e-12);
  EXPECT_NEAR(adjusted[2], 0.06, 1e-12);
  EXPECT_NEAR(adjusted[3], 0.02, 1e-12);
}

}  // namespace
}  // namespace rotorloop::bench
