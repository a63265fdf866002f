// The lag of the induced velocity: time constant, overshoot of thrust, and rest when nothing changes.
#include <gtest/gtest.h>

#include <cmath>

#include "test/unit/sim/effects/vehicle.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

constexpr double kStep_s = 1e-4;

struct Response {
  std::vector<RotorLoads> lagging, steady;
  double excess_N(std::size_t k) const { return thrust_N(lagging[k]) - thrust_N(steady[k]); }
};
// Hover until `jump`, then `after` (rad/s, or m/s of climb), at the step of kStep_s; rotor 0.
Response respond(double factor, double omega_before, double omega_after, double climb_after_m_s = 0.0, std::size_t jump = 5,
                 std::size_t count = 400) {
  const auto effect = prepared("dynamic_inflow", factor);
  Response r;
  for (std::size_t k = 0; k < count; ++k) {
    BodyMotion m = flying({0, 0, k < jump ? 0.0 : climb_after_m_s});
    m.time_s = kStep_s * static_cast<double>(k);
    const RotorSite s = site(0, m, k < jump ? omega_before : omega_after);
    r.lagging.push_back(loads_with(*effect, s));
    r.steady.push_back(solved(s));
  }
  return r;
}

TEST(DynamicInflow, LagsInHoverWithAbout1p8MillisecondsTimesItsFactor) {
  for (const double factor : {0.5, 1.0, 3.0}) {
    const Response r = respond(factor, 945, 955);
    // From two points of the decay: tau = dt / ln(ratio).
    const double tau_s = 10 * kStep_s / std::log(r.excess_N(6) / r.excess_N(16));
    EXPECT_NEAR(tau_s, factor * 0.849 * rotor().radius_m() / (4.0 * r.steady[10].induced_m_s), 0.01e-3 * factor);
    EXPECT_GT(tau_s, factor * 1.8e-3 / 1.2);
    EXPECT_LT(tau_s, factor * 1.8e-3 * 1.2);
  }
}
TEST(DynamicInflow, ThrustOvershootsWhenTheRotorSpeedsUpAndUndershootsWhenItSlows) {
  const Response up = respond(1.0, 945, 1000), down = respond(1.0, 945, 890);
  EXPECT_GT(up.excess_N(5), 0.0);
  EXPECT_LT(down.excess_N(5), 0.0);
  for (std::size_t k = 6; k < 50; ++k) {
    EXPECT_GT(up.excess_N(k), 0.0);
    EXPECT_LT(up.excess_N(k), up.excess_N(k - 1)) << "it only decays, step " << k;
  }
}
TEST(DynamicInflow, OvershootIsTheThrustOfTheNewSpeedInTheOldInflow) {
  // A climb at which the whole flow through the disk is what it was before the step; lag so slow that the inflow stands still.
  const double before = 945, after = 964;
  const Response r = respond(5.0, before, after);
  const double flow_m_s = solve_cold(rotor(), at(0, 0, 0, before)).induced_m_s;
  double low = -3.0, high = 3.0;
  for (int i = 0; i < 50; ++i) {
    const double climb = 0.5 * (low + high);
    (climb + solve_cold(rotor(), at(0, 0, climb, after)).induced_m_s < flow_m_s ? low : high) = climb;
  }
  const double frozen_N = thrust_N(solve_cold(rotor(), at(0, 0, low, after)));
  const double steady_N = thrust_N(solve_cold(rotor(), at(0, 0, 0, after)));
  EXPECT_GT(frozen_N - steady_N, 0.005);
  EXPECT_NEAR(r.excess_N(5) / (frozen_N - steady_N), 1.0, 0.08) << "the climb spreads its flow evenly over the radius, the inflow does not";
}
TEST(DynamicInflow, ReachesTheSteadyThrustWithin20TimeConstants) {
  const Response r = respond(1.0, 945, 1000);
  EXPECT_NEAR(r.excess_N(399), 0.0, 1e-7);
  EXPECT_GT(std::fabs(r.excess_N(5)), 0.02);
}
TEST(DynamicInflow, AClimbThatBeginsCostsMoreThrustAtFirst) {
  const Response r = respond(1.0, 945, 945, 2.0);
  EXPECT_LT(r.excess_N(5), 0.0);
}
TEST(DynamicInflow, ChangesNothingWhileNothingChangesAndNeverTheInPlaneForce) {
  const Response rest = respond(1.0, 945, 945), step = respond(1.0, 945, 1000);
  for (std::size_t k = 0; k < rest.steady.size(); ++k) {
    EXPECT_EQ(rest.excess_N(k), 0.0);
    EXPECT_EQ(step.lagging[k].force_R_N.head<2>(), step.steady[k].force_R_N.head<2>());
  }
}
TEST(DynamicInflow, TorqueAndItsReactionLagTogether) {
  const Response r = respond(1.0, 945, 1000);
  EXPECT_NE(r.lagging[5].shaft_torque_N_m, r.steady[5].shaft_torque_N_m);
  EXPECT_NEAR(r.lagging[5].moment_R_N_m.z(), -r.lagging[5].shaft_torque_N_m, 1e-12) << "rotor 1 turns counter-clockwise";
}
TEST(DynamicInflow, EachRotorLagsForItself) {
  const auto effect = prepared("dynamic_inflow", 1.0);
  BodyMotion m = flying({0, 0, 0});
  for (int k = 0; k < 3; ++k) {
    m.time_s = kStep_s * k;
    for (std::size_t i = 0; i < 4; ++i) {
      const RotorSite s = site(i, m, k == 2 && i == 1 ? 1000 : 945);
      const double excess_N = thrust_N(loads_with(*effect, s)) - thrust_N(solved(s));
      EXPECT_EQ(excess_N > 0.01, k == 2 && i == 1) << "step " << k << ", rotor " << i;
    }
  }
}
TEST(DynamicInflow, StaysSmallAndFiniteThroughTheVortexRing) {
  const auto effect = prepared("dynamic_inflow", 5.0);
  for (int k = 0; k < 3000; ++k) {
    BodyMotion m = flying({0, 0, -0.005 * k});
    m.time_s = 5e-4 * k;
    const RotorSite s = site(0, m);
    const double excess_N = thrust_N(loads_with(*effect, s)) - thrust_N(solved(s));
    ASSERT_LT(std::fabs(excess_N), 0.5) << "descent at " << 0.005 * k << " m/s";
  }
}

}  // namespace
}  // namespace rotorloop::sim
