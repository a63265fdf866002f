// The bounded least-squares search, on functions whose minimum is known.
#include "host/base/least_squares.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/base/error.hpp"

namespace rotorloop {
namespace {
std::vector<BoundedParameter> two(double max_b = 10.0) { return {{"a", "1", 1.0, -10.0, 10.0, 1e-4}, {"b", "1", 1.0, -10.0, max_b, 1e-4}}; }

// y = a exp(b x), measured without error at five x.
Eigen::VectorXd exponential(const std::vector<double>& v) {
  Eigen::VectorXd r(5);
  for (int i = 0; i < 5; ++i) r[i] = v[0] * std::exp(v[1] * 0.25 * i) - 2.5 * std::exp(-1.5 * 0.25 * i);
  return r;
}
// Rosenbrock's valley: minimum 0 at (1, 1), reached along a bent floor. The third residual keeps the count above the parameters.
Eigen::VectorXd valley(const std::vector<double>& v) { return Eigen::Vector3d(10.0 * (v[1] - v[0] * v[0]), 1.0 - v[0], 0.0); }

TEST(LeastSquares, FindsBothNumbersOfAnExponential) {
  const auto fit = fit_least_squares(two(), exponential);
  EXPECT_TRUE(fit.converged);
  EXPECT_NEAR(fit.values[0], 2.5, 1e-5);
  EXPECT_NEAR(fit.values[1], -1.5, 1e-5);
}
TEST(LeastSquares, FollowsABentValley) {
  std::vector<BoundedParameter> p = two();
  p[0].start = -1.2;
  const auto fit = fit_least_squares(p, valley);
  EXPECT_NEAR(fit.values[0], 1.0, 1e-3);
  EXPECT_NEAR(fit.values[1], 1.0, 2e-3);
}
// With b <= 0.25 the floor of the valley ends at a = 0.5, and a little beyond lies the least sum: 400 a^3 - 98 a - 2 = 0.
TEST(LeastSquares, RestsAtABoundAndSaysSo) {
  const auto fit = fit_least_squares(two(0.25), valley);
  EXPECT_EQ(fit.values[1], 0.25);
  EXPECT_TRUE(fit.at_bound[1]);
  EXPECT_FALSE(fit.at_bound[0]);
  EXPECT_TRUE(std::isnan(fit.standard_errors[1]));
  EXPECT_NEAR(200.0 * std::pow(fit.values[0], 3) - 49.0 * fit.values[0] - 1.0, 0.0, 0.05);
}
TEST(LeastSquares, StandardErrorOfAMeanIsTheScatterOverTheRootOfTheCount) {
  const auto mean = [](const std::vector<double>& v) { return Eigen::VectorXd(Eigen::Vector4d(-1, 1, -1, 1).array() + v[0] - 3.0); };
  const auto fit = fit_least_squares({{"a", "1", 0.0, -10.0, 10.0, 1e-3}}, mean);
  EXPECT_NEAR(fit.values[0], 3.0, 1e-6);
  EXPECT_NEAR(fit.standard_errors[0], std::sqrt(4.0 / 3.0 / 4.0), 1e-6);
}
TEST(LeastSquares, AParameterThatNoResidualKnowsHasNoFiniteStandardError) {
  const auto first_only = [](const std::vector<double>& v) { return Eigen::VectorXd(Eigen::Vector4d(-1, 1, -1, 1).array() + v[0] - 3.0); };
  const auto fit = fit_least_squares(two(), first_only);
  EXPECT_NEAR(fit.values[0], 3.0, 1e-6);
  EXPECT_FALSE(std::isfinite(fit.standard_errors[1]));
}
TEST(LeastSquares, FewerRowsThanParametersAreRefusedAsBadData) {
  try {
    fit_least_squares(two(), [](const std::vector<double>&) { return Eigen::VectorXd(Eigen::Vector2d(1, 2)); });
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::data_quality);
  }
}

}  // namespace
}  // namespace rotorloop
