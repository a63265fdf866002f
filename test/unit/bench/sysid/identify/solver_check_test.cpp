// The check by Ceres: how far two fits lie apart, what counts as far, and that a wrong answer is found and named.
#include "bench/sysid/identify/solver_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "bench/sysid/identify/report/identify_result.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::identify {
namespace {

using testing::HasSubstr;

estimate::Fit made(double k1, double u_k1, double c_dh, double u_c_dh, double cost) {
  estimate::Fit f;
  f.cost = cost;
  f.estimates = {{.parameter = estimate::kK1, .value = k1, .u = u_k1}, {.parameter = estimate::kCdh, .value = c_dh, .u = u_c_dh}};
  return f;
}

TEST(FitDifference, NamesTheFarthestEstimateInItsOwnUncertaintiesAndTheFarthestUncertainty) {
  const FitDifference d = difference_of_fits(made(2e-6, 1e-8, 0.02, 4e-3, 500.0), made(2.001e-6, 0.9e-8, 0.019, 4.04e-3, 500.005), {});
  EXPECT_NEAR(d.cost, 1e-5, 1e-12);
  EXPECT_NEAR(d.estimate_u, -0.25, 1e-9) << "c_d,h by -0.001 at 0.004, not k_1 by a tenth of its own";
  EXPECT_EQ(d.estimate, "c_d,h");
  EXPECT_NEAR(d.uncertainty, -0.1, 1e-9);
  EXPECT_EQ(d.of, "k_1");
}

TEST(FitDifference, ANumberThatIsNoneIsFartherThanAnyOther) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const FitDifference d = difference_of_fits(made(2e-6, 1e-8, 0.02, 4e-3, 500.0), made(none, 1e-8, 0.5, none, 500.0), {});
  EXPECT_EQ(d.estimate, "k_1");
  EXPECT_EQ(d.of, "c_d,h");
  EXPECT_FALSE(within_acceptance(d));
  EXPECT_TRUE(far_apart(d, d));
}

TEST(FitDifference, IsFarBeyondAQuarterOfAnUncertaintyFivePercentOfItOrAMillionthOfTheCost) {
  const FitDifference same;
  EXPECT_TRUE(within_acceptance(same));
  EXPECT_FALSE(far_apart(same, same));
  const FitDifference near{.cost = 9e-7, .estimate_u = -0.24, .uncertainty = 0.049};
  EXPECT_FALSE(within_acceptance(near));
  EXPECT_FALSE(far_apart(near, near));
  EXPECT_TRUE(far_apart({.estimate_u = -0.26}, same));
  EXPECT_TRUE(far_apart({.uncertainty = -0.051}, same));
  EXPECT_TRUE(far_apart(same, {.cost = 1.1e-6}));
  EXPECT_FALSE(within_acceptance({.estimate_u = 1.1e-4}));
  EXPECT_FALSE(within_acceptance({.uncertainty = -1.1e-6}));
  EXPECT_FALSE(within_acceptance({.cost = 1.1e-8}));
}

// Two short flights that obey the model, and their fit from the paper's file.
class SolverCheckOfAFit : public testing::Test {
 protected:
  static IdentifyOptions options() {
    IdentifyOptions o;
    o.grid.rate_Hz = 50.0;
    o.fit.noise.rounds = 0;
    o.wishes.hold = {"pose_delay"};
    return o;
  }
  static Identification identified() {
    const auto flown = [](model_true::Manoeuvre m) {
      return FlightToFit{model_true::fly({}, {.manoeuvre = m, .seed = 5, .duration_s = 3.0}).record, FlightRole::any, {}, {}};
    };
    const auto paper = host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/paper.toml", host::builtin_effect_catalogue());
    return identify({flown(model_true::Manoeuvre::rotation), flown(model_true::Manoeuvre::horizontal)}, paper, options());
  }
};

TEST_F(SolverCheckOfAFit, FindsBothSolversWithinTheLimitsOfTheAcceptancePageOnceBothRanToTheirEnd) {
  const Identification r = identified();
  const SolverCheck c = check_by_ceres(r, options().fit);
  EXPECT_EQ(c.failure, "");
  EXPECT_TRUE(c.good()) << solver_check_problem(c);
  EXPECT_TRUE(within_acceptance(c.to_the_end)) << solver_check_text(c);
  EXPECT_GT(c.iterations, 1) << "Ceres began where the fit began, not where it ended";
  EXPECT_THAT(solver_check_text(c), HasSubstr(": within the limits of docs/acceptance/identify_speed.md"));
}

TEST_F(SolverCheckOfAFit, NamesAnEstimateThatIsHalfAnUncertaintyOffAndAnUncertaintyThatIsTenPercentOff) {
  Identification r = identified();
  for (estimate::Estimate& e : r.fit.estimates) {
    if (e.parameter == estimate::kCdh) e.value += 0.5 * e.u;
    if (e.parameter == estimate::kIyy) e.u *= 1.1;
  }
  const SolverCheck c = check_by_ceres(r, options().fit);
  EXPECT_FALSE(c.good());
  EXPECT_THAT(solver_check_problem(c), HasSubstr("c_d,h by -0.5 standard uncertainties"));
  EXPECT_THAT(solver_check_problem(c), HasSubstr("uncertainty of I_yy by -9.1 %"));
}

TEST_F(SolverCheckOfAFit, TellsWhatCeresSaidWhereItGivesNoAnswer) {
  Identification r = identified();
  r.problem.start[estimate::kIyy] = -0.004;
  const SolverCheck c = check_by_ceres(r, options().fit);
  EXPECT_FALSE(c.good());
  EXPECT_THAT(solver_check_text(c), HasSubstr("came to no answer: start value of body.inertia.yy is -0.004 kg m2"));
}

}  // namespace
}  // namespace rotorloop::identify
