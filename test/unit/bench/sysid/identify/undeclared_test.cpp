// The sets of another simulator: stages of the paper and joint fit must agree within their uncertainty, or say what does not.
// Figures of all six: docs/acceptance/identify_measured.md.
#include <fmt/format.h>

#include <cmath>

#include "test/unit/bench/sysid/identify/measured_fit.hpp"

namespace rotorloop::identify {
namespace {

Identification staged(const std::string& name, double pose_late_s) {
  const MeasuredSet set{name};
  IdentifyOptions o;
  o.grid.rate_Hz = 100.0;
  o.fit.noise.rounds = 8;
  std::vector<FlightToFit> flights;
  for (const auto& [stem, role] :
       {std::pair{"vertical", FlightRole::vertical}, {"horizontal", FlightRole::horizontal}, {"rotation", FlightRole::rotation}})
    flights.push_back({.record = set.flight(stem), .role = role, .segments = {}, .pose_late_s = pose_late_s});
  Identification r = identify(flights, set.vehicle(), o);
  for (const StageComparison& c : r.comparison)
    fmt::print("{:<10} {:<7} {:>12.5g} ± {:.2g}, joint {:>12.5g} ± {:.2g}, z {:+.1f}\n", identify::name(c.role),
               estimate::parameter_info(c.parameter, r.problem.start.terms).symbol, c.stage, c.u_stage, c.joint, c.u_joint, c.z);
  return r;
}

TEST(Undeclared, StagesAndJointFitOfSetCAgreeAndTheResidualsAreNoise) {
  if (!MeasuredSet::present()) GTEST_SKIP() << "ROTORLOOP_DATA is not set: the undeclared sets are not fitted";
  const Identification r = staged("undeclared_c", 0.0);
  EXPECT_TRUE(r.fit.converged);
  EXPECT_NEAR(2.0 * r.fit.cost / r.fit.degrees_of_freedom, 1.0, 0.01);
  ASSERT_GE(r.comparison.size(), 20u);
  int apart = 0;
  for (const StageComparison& c : r.comparison) {
    apart += !c.agrees;
    EXPECT_LT(std::fabs(c.z), 4.0) << estimate::parameter_info(c.parameter, r.problem.start.terms).symbol;
  }
  EXPECT_LE(apart, 1) << "of " << r.comparison.size() << " comparisons at three standard uncertainties";
  // The inertias of three stages of 30 s are worth two per mille; a guess 10 % off would be seen.
  EXPECT_LT(r.fit.find(estimate::kIxx)->u_robust, 5e-3 * r.fit.find(estimate::kIxx)->value);
}

TEST(Undeclared, SetFHasPoses20msLateFoundToATenthOfAMillisecondEvenFromAGuess6msOff) {
  if (!MeasuredSet::present()) GTEST_SKIP() << "ROTORLOOP_DATA is not set: the undeclared sets are not fitted";
  const Identification r = staged("undeclared_f", 0.014);
  const estimate::Estimate* delay = r.fit.find(estimate::kPoseDelay);
  ASSERT_TRUE(delay);
  EXPECT_NEAR(delay->value, 0.0200, 1e-4);
  EXPECT_NEAR(2.0 * r.fit.cost / r.fit.degrees_of_freedom, 1.0, 0.01);
}

}  // namespace
}  // namespace rotorloop::identify
