// Section data: what the tables of the solve keep of a polar, and what stall delay adds.
#include <gtest/gtest.h>

#include <cmath>

#include "test/unit/sim/rotor/fixtures.hpp"

namespace rotorloop::sim {
namespace {
const Polar& naca4412() {
  static const Polar polar = read_polar(ROTORLOOP_SOURCE_DIR "/vehicles/polars/naca4412.toml");
  return polar;
}

double diamond(double alpha_deg) {
  const double a = alpha_deg * std::numbers::pi / 180.0, x = std::cos(a), y = std::sin(a);
  const double p = y / (std::abs(x) + std::abs(y));
  return x < 0 ? std::copysign(2.0, y) - p : p;
}

TEST(DiamondAngle, IsUndoneToTheAngleOfAttackOverTheWholeCircle) {
  for (double alpha = -179.9; alpha < 180; alpha += 0.7) EXPECT_NEAR(angle_of_direction_deg(diamond(alpha)), alpha, 1e-10) << alpha;
}
TEST(Naca4412, HasTheTextbookFiguresAtReynolds100000) {
  // Thin airfoil theory with the usual loss at this Reynolds number: zero lift near -4 deg, slope 5 to 6.5 per rad, minimum drag 0.01 to
  // 0.03.
  double zero = 0.0, least_drag = 1.0;
  for (double a = -8; a < 8; a += 0.05) {
    const auto c = polar_at(naca4412(), a, 1e5);
    if (c.cl < 0) zero = a;
    least_drag = std::min(least_drag, c.cd);
  }
  EXPECT_NEAR(zero, -4.0, 1.0);
  const double slope = (polar_at(naca4412(), 6, 1e5).cl - polar_at(naca4412(), 0, 1e5).cl) / (6 * std::numbers::pi / 180);
  EXPECT_GT(slope, 4.5);
  EXPECT_LT(slope, 6.5);
  EXPECT_GT(least_drag, 0.01);
  EXPECT_LT(least_drag, 0.03);
}
TEST(Naca4412, DragFallsWithReynoldsNumber) { EXPECT_GT(polar_at(naca4412(), 4, 3e4).cd, 1.5 * polar_at(naca4412(), 4, 1.5e5).cd); }
TEST(Naca4412, BroadsideIsAPlate) {
  const auto c = polar_at(naca4412(), 90, 5e4);
  EXPECT_NEAR(c.cl, 0.0, 0.05);
  EXPECT_NEAR(c.cd, 1.2, 0.1);
}
TEST(Naca4412, LiftAndDragAreContinuousOverTheCircle) {
  for (double re : {2e4, 5e4, 2e5})
    for (double a = -180; a < 180; a += 0.1) {
      const auto c = polar_at(naca4412(), a, re), d = polar_at(naca4412(), a + 0.1, re);
      EXPECT_LT(std::abs(c.cl - d.cl), 0.06) << a << " deg, Re " << re;
      EXPECT_LT(std::abs(c.cd - d.cd), 0.03) << a << " deg, Re " << re;
    }
}

// Lift and drag of a section that lies in the disk plane: the flow comes from below by the angle of attack.
SectionCoefficients section(const SectionTable& t, double alpha_deg, double reynolds) {
  const SectionForce f = lookup(t, diamond(-alpha_deg), reynolds);
  const double inflow = -alpha_deg * std::numbers::pi / 180.0;
  return {f.up * std::cos(inflow) + f.drag * std::sin(inflow), f.drag * std::cos(inflow) - f.up * std::sin(inflow)};
}

TEST(SectionTable, KeepsThePolarToOneHundredthOfLiftAndDragCount10) {
  const SectionTable t = prepare_section(naca4412(), naca4412(), 0.0);
  for (double re : {1e4, 2.5e4, 4.4e4, 1.33e5, 9e5})
    for (double a = -179; a < 180; a += 0.37) {
      const auto exact = polar_at(naca4412(), a, re), found = section(t, a, re);
      EXPECT_NEAR(found.cl, exact.cl, 0.01) << a << " deg, Re " << re;
      EXPECT_NEAR(found.cd, exact.cd, 0.002) << a << " deg, Re " << re;
    }
}
TEST(SectionTable, TwistTurnsTheSectionAgainstTheFlow) {
  const SectionTable flat = prepare_section(naca4412(), naca4412(), 0.0), twisted = prepare_section(naca4412(), naca4412(), 0.0, 25.0);
  for (double inflow : {-100.0, -3.0, 0.0, 17.0, 80.0, 179.0}) {
    const SectionForce f = lookup(twisted, diamond(inflow), 5e4);
    double alpha = 25.0 - inflow;
    if (alpha < -180.0) alpha += 360.0;
    const SectionCoefficients c = section(flat, alpha, 5e4);
    const double angle = inflow * std::numbers::pi / 180.0;
    EXPECT_NEAR(f.up, c.cl * std::cos(angle) - c.cd * std::sin(angle), 0.01) << inflow;
    EXPECT_NEAR(f.drag, c.cl * std::sin(angle) + c.cd * std::cos(angle), 0.005) << inflow;
  }
}
TEST(SectionTable, BlendOfTwoStationsLiesBetweenThem) {
  const Polar thin = read_polar(ROTORLOOP_SOURCE_DIR "/vehicles/polars/naca4410.toml");
  const SectionTable a = prepare_section(naca4412(), thin, 0.0), b = prepare_section(naca4412(), thin, 1.0);
  const SectionTable half = prepare_section(naca4412(), thin, 0.5);
  for (double alpha : {-30.0, 3.0, 12.0, 70.0}) {
    EXPECT_NEAR(section(half, alpha, 5e4).cl, 0.5 * (section(a, alpha, 5e4).cl + section(b, alpha, 5e4).cl), 1e-12);
  }
}
// The table holds lift and drag turned by the inflow angle; straight lines between its nodes mix them by so much.
constexpr double kTurned = 5e-5;

TEST(StallDelay, RaisesStalledLiftTowardsPotentialFlowAndLeavesDragAndNegativeAnglesAlone) {
  const SectionTable flat = prepare_section(naca4412(), naca4412(), 0.0),
                     delayed = prepare_section(naca4412(), naca4412(), 0.0, 0.0, {.stall_delay_share = 0.5});
  const double potential = 2 * std::numbers::pi * std::sin(24 * std::numbers::pi / 180);
  EXPECT_GT(section(delayed, 20, 4e4).cl, section(flat, 20, 4e4).cl + 0.3);
  EXPECT_LT(section(delayed, 20, 4e4).cl, potential);
  for (double a : {-150.0, -60.0, -12.0, 61.0, 120.0}) EXPECT_NEAR(section(delayed, a, 4e4).cl, section(flat, a, 4e4).cl, kTurned) << a;
  for (double a = -170; a < 175; a += 5) EXPECT_NEAR(section(delayed, a, 4e4).cd, section(flat, a, 4e4).cd, kTurned) << a;
}
TEST(DragScale, ScalesDragAndLeavesLift) {
  const SectionTable plain = prepare_section(naca4412(), naca4412(), 0.0),
                     draggy = prepare_section(naca4412(), naca4412(), 0.0, 0.0, {.drag_scale = 1.3});
  for (double a : {-90.0, 0.0, 8.0, 30.0}) {
    EXPECT_NEAR(section(draggy, a, 4e4).cd, 1.3 * section(plain, a, 4e4).cd, kTurned);
    EXPECT_NEAR(section(draggy, a, 4e4).cl, section(plain, a, 4e4).cl, kTurned);
  }
}
TEST(LiftScale, ScalesLiftDelayedStallIncludedAndLeavesDrag) {
  const SectionTable plain = prepare_section(naca4412(), naca4412(), 0.0, 0.0, {.stall_delay_share = 0.5}),
                     scaled = prepare_section(naca4412(), naca4412(), 0.0, 0.0, {.stall_delay_share = 0.5, .lift_scale = 0.9});
  for (double a : {-150.0, -10.0, 5.0, 20.0, 45.0, 90.0}) {
    EXPECT_NEAR(section(scaled, a, 4e4).cl, 0.9 * section(plain, a, 4e4).cl, kTurned) << a;
    EXPECT_NEAR(section(scaled, a, 4e4).cd, section(plain, a, 4e4).cd, kTurned) << a;
  }
}
// What is regained acts at right angles to the chord: lift and drag grow by (cos alpha, sin alpha) of one force.
TEST(StallDrag, LiftRegainedByStallDelayBringsItsTangentAsDrag) {
  const SectionTable flat = prepare_section(naca4412(), naca4412(), 0.0),
                     delayed = prepare_section(naca4412(), naca4412(), 0.0, 0.0, {.stall_delay_share = 0.5, .stall_drag = 1.0});
  for (double a : {8.0, 14.0, 20.0, 35.0}) {
    const auto before = section(flat, a, 4e4), after = section(delayed, a, 4e4);
    EXPECT_GT(after.cl, before.cl) << a;
    EXPECT_NEAR(after.cd - before.cd, (after.cl - before.cl) * std::tan(a * std::numbers::pi / 180), 2e-4) << a;
  }
  for (double a : {-60.0, -8.0, -2.0, 70.0, 150.0}) EXPECT_NEAR(section(delayed, a, 4e4).cd, section(flat, a, 4e4).cd, kTurned) << a;
}
TEST(StallDelay, NeverTakesLiftAway) {
  const SectionTable flat = prepare_section(naca4412(), naca4412(), 0.0),
                     delayed = prepare_section(naca4412(), naca4412(), 0.0, 0.0, {.stall_delay_share = 1.0});
  for (double a = -179; a < 180; a += 0.5) EXPECT_GE(section(delayed, a, 4e4).cl, section(flat, a, 4e4).cl - kTurned) << a;
}

}  // namespace
}  // namespace rotorloop::sim
