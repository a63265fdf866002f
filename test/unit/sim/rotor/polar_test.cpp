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

TEST(SectionTable, KeepsThePolarToOneHundredthOfLiftAndDragCount10) {
  const SectionTable t = prepare_section(naca4412(), naca4412(), 0.0);
  for (double re : {1e4, 2.5e4, 4.4e4, 1.33e5, 9e5})
    for (double a = -179; a < 180; a += 0.37) {
      const auto exact = polar_at(naca4412(), a, re), found = lookup(t, diamond(a), re);
      EXPECT_NEAR(found.cl, exact.cl, 0.01) << a << " deg, Re " << re;
      EXPECT_NEAR(found.cd, exact.cd, 0.002) << a << " deg, Re " << re;
    }
}
TEST(SectionTable, BlendOfTwoStationsLiesBetweenThem) {
  const Polar thin = read_polar(ROTORLOOP_SOURCE_DIR "/vehicles/polars/naca4410.toml");
  const SectionTable a = prepare_section(naca4412(), thin, 0.0), b = prepare_section(naca4412(), thin, 1.0);
  const SectionTable half = prepare_section(naca4412(), thin, 0.5);
  for (double alpha : {-30.0, 3.0, 12.0, 70.0}) {
    const double p = diamond(alpha);
    EXPECT_NEAR(lookup(half, p, 5e4).cl, 0.5 * (lookup(a, p, 5e4).cl + lookup(b, p, 5e4).cl), 1e-12);
  }
}
TEST(StallDelay, RaisesStalledLiftTowardsPotentialFlowAndLeavesDragAndNegativeAnglesAlone) {
  const SectionTable flat = prepare_section(naca4412(), naca4412(), 0.0),
                     delayed = prepare_section(naca4412(), naca4412(), 0.0, {.stall_delay_share = 0.5});
  const double p = diamond(20), potential = 2 * std::numbers::pi * std::sin(24 * std::numbers::pi / 180);
  EXPECT_GT(lookup(delayed, p, 4e4).cl, lookup(flat, p, 4e4).cl + 0.3);
  EXPECT_LT(lookup(delayed, p, 4e4).cl, potential);
  for (double a : {-150.0, -60.0, -12.0, 61.0, 120.0})
    EXPECT_EQ(lookup(delayed, diamond(a), 4e4).cl, lookup(flat, diamond(a), 4e4).cl) << a;
  for (double a = -170; a < 175; a += 5) EXPECT_EQ(lookup(delayed, diamond(a), 4e4).cd, lookup(flat, diamond(a), 4e4).cd) << a;
}
TEST(DragScale, ScalesDragAndLeavesLift) {
  const SectionTable plain = prepare_section(naca4412(), naca4412(), 0.0),
                     draggy = prepare_section(naca4412(), naca4412(), 0.0, {.drag_scale = 1.3});
  for (double a : {-90.0, 0.0, 8.0, 30.0}) {
    EXPECT_NEAR(lookup(draggy, diamond(a), 4e4).cd, 1.3 * lookup(plain, diamond(a), 4e4).cd, 1e-12);
    EXPECT_EQ(lookup(draggy, diamond(a), 4e4).cl, lookup(plain, diamond(a), 4e4).cl);
  }
}
TEST(LiftScale, ScalesLiftDelayedStallIncludedAndLeavesDrag) {
  const SectionTable plain = prepare_section(naca4412(), naca4412(), 0.0, {.stall_delay_share = 0.5}),
                     scaled = prepare_section(naca4412(), naca4412(), 0.0, {.stall_delay_share = 0.5, .lift_scale = 0.9});
  for (double a : {-150.0, -10.0, 5.0, 20.0, 45.0, 90.0}) {
    EXPECT_NEAR(lookup(scaled, diamond(a), 4e4).cl, 0.9 * lookup(plain, diamond(a), 4e4).cl, 1e-12) << a;
    EXPECT_EQ(lookup(scaled, diamond(a), 4e4).cd, lookup(plain, diamond(a), 4e4).cd) << a;
  }
}
// What is regained acts at right angles to the chord: lift and drag grow by (cos alpha, sin alpha) of one force.
TEST(StallDrag, LiftRegainedByStallDelayBringsItsTangentAsDrag) {
  const SectionTable flat = prepare_section(naca4412(), naca4412(), 0.0),
                     delayed = prepare_section(naca4412(), naca4412(), 0.0, {.stall_delay_share = 0.5, .stall_drag = 1.0});
  for (double a : {8.0, 14.0, 20.0, 35.0}) {
    const auto before = lookup(flat, diamond(a), 4e4), after = lookup(delayed, diamond(a), 4e4);
    EXPECT_GT(after.cl, before.cl) << a;
    EXPECT_NEAR(after.cd - before.cd, (after.cl - before.cl) * std::tan(a * std::numbers::pi / 180), 2e-4) << a;
  }
  for (double a : {-60.0, -8.0, -2.0, 70.0, 150.0}) EXPECT_EQ(lookup(delayed, diamond(a), 4e4).cd, lookup(flat, diamond(a), 4e4).cd) << a;
}
TEST(StallDelay, NeverTakesLiftAway) {
  const SectionTable flat = prepare_section(naca4412(), naca4412(), 0.0),
                     delayed = prepare_section(naca4412(), naca4412(), 0.0, {.stall_delay_share = 1.0});
  for (double a = -179; a < 180; a += 0.5) EXPECT_GE(lookup(delayed, diamond(a), 4e4).cl, lookup(flat, diamond(a), 4e4).cl) << a;
}

}  // namespace
}  // namespace rotorloop::sim
