// The momentum side: mass flow in every state of the rotor, and Prandtl's loss.
#include "sim/rotor/inflow.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/rotor/prandtl.hpp"

namespace rotorloop::sim {
namespace {
// Induced velocity over that in hover, for thrust v_h = 1: bisection of v U(v) = 1.
double induced(double climb, double edgewise) {
  double low = 0.0, high = 50.0;
  for (int i = 0; i < 80; ++i) {
    const double v = 0.5 * (low + high);
    (v * mass_flow(v, climb, edgewise * edgewise).speed_m_s < 1.0 ? low : high) = v;
  }
  return 0.5 * (low + high);
}
double quartic(double x) { return 1 - 1.125 * x - 1.372 * x * x - 1.718 * x * x * x - 0.655 * x * x * x * x; }

TEST(Inflow, HoverGivesTheHoverVelocity) { EXPECT_NEAR(induced(0, 0), 1.0, 1e-12); }
TEST(Inflow, ClimbFollowsMomentumTheory) {
  for (double x : {0.2, 0.5, 1.0, 3.0}) EXPECT_NEAR(induced(x, 0), -0.5 * x + std::sqrt(0.25 * x * x + 1), 1e-12) << x;
}
TEST(Inflow, WindmillBeyondTwiceHoverSpeedFollowsMomentumTheory) {
  for (double x : {-2.2, -3.0, -5.0}) EXPECT_NEAR(induced(x, 0), -0.5 * x - std::sqrt(0.25 * x * x - 1), 1e-9) << x;
}
TEST(Inflow, VortexRingFollowsTheMeasuredQuarticWithinThreePercent) {
  for (double x : {-0.6, -0.8, -1.0, -1.2, -1.4, -1.6, -1.8}) EXPECT_NEAR(induced(x, 0), quartic(x), 0.03 * quartic(x)) << x;
}
TEST(Inflow, BareMomentumTheoryWouldMissTheMeasuredInflowByTwelvePercent) {
  EXPECT_GT(quartic(-1.0) / (0.5 + std::sqrt(1.25)), 1.12);  // what the empirical branch is for
}
TEST(Inflow, EdgewiseFlowFollowsGlauert) {
  for (double mu : {0.3, 1.0, 2.0}) {
    const double v = induced(0, mu);
    EXPECT_NEAR(v * std::sqrt(mu * mu + v * v), 1.0, 1e-12) << mu;
  }
}
TEST(Inflow, VortexRingIsGoneAtAnEdgewiseSpeedOfHoverVelocity) {
  for (double x : {-0.5, -1.0, -1.5}) {
    const double v = induced(x, 1.3);
    EXPECT_NEAR(v * std::sqrt(1.69 + (x + v) * (x + v)), 1.0, 1e-9) << x;
    EXPECT_EQ(mass_flow(v, x, 1.69).ring, 0.0);
  }
}
TEST(Inflow, VortexRingBeginsBelowAFifthOfHoverVelocity) {
  EXPECT_EQ(mass_flow(induced(-0.15, 0), -0.15, 0).ring, 0.0);
  EXPECT_EQ(mass_flow(induced(-0.5, 0), -0.5, 0).ring, 1.0);
}
// The balance with the blades has one solution only if the momentum side rises with v everywhere.
TEST(Inflow, MomentumThrustRisesWithInducedVelocityAtEveryDescentAndEdgewiseSpeed) {
  for (double mu = 0; mu < 2; mu += 0.02) {
    double before = 0.0;
    for (double v = 0.01; v < 8; v += 0.01) {
      const double thrust = v * mass_flow(v, -1.0, mu * mu).speed_m_s;
      EXPECT_GT(thrust, before) << "v " << v << " mu " << mu;
      before = thrust;
    }
  }
}
TEST(Inflow, NegativeThrustIsTheMirrorImage) {
  for (double v : {0.3, 1.0, 2.0})
    for (double climb : {-3.0, -1.0, 0.0, 2.0}) EXPECT_EQ(mass_flow(v, climb, 0.25).speed_m_s, mass_flow(-v, -climb, 0.25).speed_m_s);
}
TEST(Inflow, MassFlowHasNoStepOverTheJoins) {
  for (double mu : {0.0, 0.2, 0.5}) {
    double before = mass_flow(0.2, -1.0, mu * mu).speed_m_s;
    for (double v = 0.2; v < 7; v += 1e-3) {
      const double u = mass_flow(v, -1.0, mu * mu).speed_m_s;
      EXPECT_LT(std::abs(u - before), 6e-3) << "v " << v << " mu " << mu;
      before = u;
    }
  }
}

TEST(PrandtlLoss, TableKeepsTheFormulaTo3e5) {
  for (double f = 0.0; f < 20; f += 0.0137)
    EXPECT_NEAR(prandtl_factor(std::sqrt(f)), 2 / std::numbers::pi * std::acos(std::exp(-f)), 3e-5) << f;
}
TEST(PrandtlLoss, IsWholeFarFromTheEdgesAndZeroAtTheTip) {
  EXPECT_NEAR(prandtl_loss(1e9, 1.0, 1.0), 1.0, 1e-6);
  EXPECT_EQ(prandtl_loss(3.0, 0.0, 1.0), 0.0);
}

}  // namespace
}  // namespace rotorloop::sim
