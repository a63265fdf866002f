// What a fit holds first where something is known beforehand, and where the whole fit then starts.
#include "bench/sysid/estimate/staged_fit.hpp"

#include <gtest/gtest.h>

namespace rotorloop::estimate {
namespace {

FitProblem problem() {
  FitProblem p;
  p.start = model_values(host::VehicleModel{});
  p.start[kMass] = 0.68;
  p.start[kK1] = 3e-6;
  p.start[kK2] = -1e-4;
  for (const int k : {kK1, kK2, kCq}) p.free.push_back({k});
  p.free.push_back({kMass, false, 0.01});
  p.free.push_back({kGyroBiasX, true, 0.01});
  return p;
}

JointPrior about(int parameter, double mean, double u) {
  return {{parameter}, Eigen::VectorXd::Constant(1, mean), Eigen::MatrixXd::Constant(1, 1, 1.0 / (u * u))};
}

bool is_free(const FitProblem& p, int parameter) {
  return std::any_of(p.free.begin(), p.free.end(), [&](const FreeParameter& f) { return f.parameter == parameter; });
}

TEST(StagedFit, AProblemWithoutPriorsStaysAsItIs) {
  FitProblem p = problem();
  std::erase_if(p.free, [](const FreeParameter& f) { return f.parameter == kMass; });
  EXPECT_FALSE(any_prior_holds(p));
  EXPECT_EQ(with_priors_held(p).free.size(), p.free.size());
}

TEST(StagedFit, ParametersWithPriorsAreHeldAtTheMostLikelyPointOfAllPriors) {
  FitProblem p = problem();
  p.priors = {about(kK1, 3e-6, 1e-8), about(kK1, 3.3e-6, 2e-8)};
  const FitProblem held = with_priors_held(p);
  EXPECT_NEAR(held.start[kK1], (4.0 * 3e-6 + 3.3e-6) / 5.0, 1e-12);
  EXPECT_FALSE(is_free(held, kK1));
  EXPECT_TRUE(held.priors.empty());
  EXPECT_TRUE(is_free(held, kK2)) << "nothing is known of it";
  EXPECT_TRUE(is_free(held, kCq));
}

TEST(StagedFit, AWeakPriorOfAGuessHoldsNothingAndStillCountsInTheFit) {
  FitProblem p;
  p.start = problem().start;
  p.free = {{kK1}, {kCq}};
  p.priors = {about(kCq, 2e-8, 2e-8)};
  p.priors[0].weak = true;
  EXPECT_FALSE(any_prior_holds(p));
  const FitProblem held = with_priors_held(p);
  EXPECT_TRUE(is_free(held, kCq));
  EXPECT_EQ(held.priors.size(), 1u);
}

TEST(StagedFit, WhatHasAnUncertaintyOfItsOwnIsHeldAtItsStartAndWhatEachFlightHasOfItsOwnStaysFree) {
  const FitProblem held = with_priors_held(problem());
  EXPECT_FALSE(is_free(held, kMass));
  EXPECT_EQ(held.start[kMass], 0.68);
  EXPECT_TRUE(is_free(held, kGyroBiasX));
}

// A thrust stand ties k1 and k2 in one direction only.
TEST(StagedFit, OneDirectionOfTwoParametersHoldsNeitherButMovesBothWhereEachIsKnown) {
  const Eigen::Vector2d slope(1.0, 2e-2);
  const JointPrior stand{{kK1, kK2}, Eigen::Vector2d(3.1e-6, -1e-4), slope * slope.transpose() / 1e-20};
  FitProblem alone = problem();
  alone.priors = {stand};
  const FitProblem free = with_priors_held(alone);
  EXPECT_TRUE(is_free(free, kK1) && is_free(free, kK2));
  EXPECT_EQ(free.priors.size(), 1u) << "what the stand says still counts";

  FitProblem both = alone;
  both.priors.push_back(about(kK1, 3e-6, 1e-8));
  both.priors.push_back(about(kK2, -1e-4, 5e-7));
  const FitProblem held = with_priors_held(both);
  EXPECT_FALSE(is_free(held, kK1) || is_free(held, kK2));
  // The stand is the surest: its direction holds, and the rest moves as little as the uncertainties allow.
  EXPECT_NEAR(slope.dot(Eigen::Vector2d(held.start[kK1], held.start[kK2])), slope.dot(stand.mean), 1e-9);
  EXPECT_NEAR((held.start[kK1] - 3e-6) / (held.start[kK2] + 1e-4), 1e-16 / (2e-2 * 2.5e-13), 1e-3);
}

TEST(StagedFit, TheWholeFitStartsWhereTheFirstEndedButForWhatAStartIsTheMeanOf) {
  FitProblem p = problem();
  Fit first;
  first.values = {p.start, p.start};
  for (ModelValues& v : first.values) {
    v[kMass] = 0.7;
    v[kCq] = 2.5e-8;
  }
  first.values[1][kGyroBiasX] = 0.02;
  first.noise.resize(2);
  first.states.resize(2);
  start_from(first, p);
  EXPECT_EQ(p.start[kCq], 2.5e-8);
  EXPECT_EQ(p.start[kMass], 0.68);
  EXPECT_EQ(p.flight_start[0][kMass], 0.68);
  EXPECT_EQ(p.flight_start[1][kGyroBiasX], p.start[kGyroBiasX]);
  EXPECT_EQ(p.flight_noise.size(), 2u);
}

}  // namespace
}  // namespace rotorloop::estimate
