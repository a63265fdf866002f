// What flights say of what a vehicle file knows, on fits whose outcome is given.
#include "bench/sysid/diagnose/vehicle_priors.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace rotorloop::diagnose {
namespace {

// The file knows I_xx to 2 % and I_yy to 3 %; a fit that moved I_xx to `found`, now known to `u`.
struct Known {
  estimate::FitProblem problem;
  estimate::Fit fit;
  Known(double found, double u, double u_robust) {
    Eigen::MatrixXd information = Eigen::Vector2d(1.0 / (4e-5 * 4e-5), 1.0 / (9e-5 * 9e-5)).asDiagonal();
    problem.priors = {{{estimate::kIxx, estimate::kIyy}, Eigen::Vector2d(2e-3, 3e-3), information}};
    fit.estimates = {{.parameter = estimate::kIxx, .value = found, .u = u, .u_robust = u_robust},
                     {.parameter = estimate::kIyy, .value = 3.01e-3, .u = 5e-5, .u_robust = 5e-5}};
  }
  std::vector<Contradiction> contradicted() const { return contradictions(problem, fit); }
};

TEST(Contradictions, AnInertiaTenPercentOffAPriorOfTwoIsReportedWithBothFigures) {
  const auto all = Known(2.2e-3, 2e-5, 2e-5).contradicted();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].parameter, estimate::kIxx);
  EXPECT_DOUBLE_EQ(all[0].prior, 2e-3);
  EXPECT_NEAR(all[0].prior_u, 4e-5, 1e-12);
  EXPECT_DOUBLE_EQ(all[0].found, 2.2e-3);
  EXPECT_NEAR(all[0].z, 2e-4 / std::sqrt(4e-5 * 4e-5 - 2e-5 * 2e-5), 1e-6);
}
TEST(Contradictions, OnePercentOffWhatIsKnownToTwoIsNoContradiction) { EXPECT_TRUE(Known(2.02e-3, 2e-5, 2e-5).contradicted().empty()); }
TEST(Contradictions, BlocksThatScatterThreeTimesMoreThanTheNoiseAskForThreeTimesAsMuch) {
  EXPECT_TRUE(Known(2.2e-3, 2e-5, 6e-5).contradicted().empty());
  EXPECT_EQ(Known(2.5e-3, 2e-5, 6e-5).contradicted().size(), 1u);
}
TEST(Contradictions, FlightsThatDoNotDetermineANumberContradictNothing) {
  EXPECT_TRUE(Known(2.2e-3, 3.95e-5, 3.95e-5).contradicted().empty());
}
TEST(Contradictions, AStandThatTiesTwoNumbersInOneDirectionSaysNothingOfEach) {
  Known k(2.2e-3, 2e-5, 2e-5);
  const Eigen::Vector2d tie(1.0 / 1e-5, -1.0 / 1e-5);
  k.problem.priors[0].information = tie * tie.transpose();
  EXPECT_TRUE(k.contradicted().empty());
}

}  // namespace
}  // namespace rotorloop::diagnose
