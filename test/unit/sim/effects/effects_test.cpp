// Each effect: sign, limit to zero, size and unit; and the set that holds them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host/base/error.hpp"
#include "sim/effects/builtin.hpp"
#include "sim/effects/effect_set.hpp"

namespace rotorloop::sim {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kJ_kg_m2 = 9.4e-6;
SpinningRotor rotor(int spin, double omega_rad_s, double omega_dot_rad_s2) {
  return {Eigen::Vector3d::UnitZ(), spin, kJ_kg_m2, omega_rad_s, omega_dot_rad_s2};
}
RotorMomentum momentum(std::initializer_list<SpinningRotor> rotors) {
  RotorMomentum m;
  for (const SpinningRotor& r : rotors) m.add(r);
  return m;
}
RotorLoads some_loads() {
  RotorLoads l;
  l.force_R_N = {-0.2, 0.05, 1.7};
  l.moment_R_N_m = {0.01, -0.02, -0.028};
  l.shaft_torque_N_m = 0.028;
  return l;
}
Eigen::Vector3d reaction(const SpinningRotor& r) { return kRotorInertiaReaction.moment_B_N_m(momentum({r}), Eigen::Vector3d::Zero()); }

TEST(RotorInertiaReaction, ACounterClockwiseRotorSpeedingUpTurnsTheBodyClockwiseWith94MillinewtonmetresAt1e4) {
  EXPECT_LT((reaction(rotor(1, 900, 1e4)) - Eigen::Vector3d(0, 0, -0.094)).norm(), 1e-15);
  EXPECT_LT((reaction(rotor(-1, 900, 1e4)) - Eigen::Vector3d(0, 0, 0.094)).norm(), 1e-15);
  EXPECT_GT(reaction(rotor(1, 900, -1e4)).z(), 0.0) << "braking turns it the other way";
}
TEST(RotorInertiaReaction, VanishesAtSteadySpeedAndWithoutInertia) {
  EXPECT_EQ(reaction(rotor(1, 1500, 0)).norm(), 0.0);
  SpinningRotor weightless = rotor(1, 900, 1e4);
  weightless.inertia_kg_m2 = kRotorInertiaReaction.parameter.neutral;
  EXPECT_EQ(reaction(weightless).norm(), 0.0);
}
TEST(RotorInertiaReaction, ActsAboutTheShaftOfATiltedRotor) {
  SpinningRotor r = rotor(1, 900, 1e4);
  r.axis_B = Eigen::Vector3d(0.6, 0.0, 0.8);
  EXPECT_LT((reaction(r) + 0.094 * r.axis_B).norm(), 1e-15);
}

TEST(Gyroscopic, TurnsRollRateIntoPitchMomentByTheSurplusOfSpin) {
  const Eigen::Vector3d roll(6.5, 0, 0), pitch(0, 6.5, 0);
  const double L = kJ_kg_m2 * 945.0;
  EXPECT_LT((kGyroscopic.moment_B_N_m(momentum({rotor(1, 945, 0)}), roll) - Eigen::Vector3d(0, 6.5 * L, 0)).norm(), 1e-15);
  EXPECT_LT((kGyroscopic.moment_B_N_m(momentum({rotor(1, 945, 0)}), pitch) - Eigen::Vector3d(-6.5 * L, 0, 0)).norm(), 1e-15);
  EXPECT_LT((kGyroscopic.moment_B_N_m(momentum({rotor(-1, 945, 0)}), roll) + Eigen::Vector3d(0, 6.5 * L, 0)).norm(), 1e-15);
}
TEST(Gyroscopic, VanishesInYawAtRestWithoutInertiaAndOverEqualPairs) {
  EXPECT_EQ(kGyroscopic.moment_B_N_m(momentum({rotor(1, 945, 0)}), {0, 0, 3}).norm(), 0.0);
  EXPECT_EQ(kGyroscopic.moment_B_N_m(momentum({rotor(1, 945, 0)}), {0, 0, 0}).norm(), 0.0);
  SpinningRotor weightless = rotor(1, 945, 0);
  weightless.inertia_kg_m2 = kGyroscopic.parameter.neutral;
  EXPECT_EQ(kGyroscopic.moment_B_N_m(momentum({weightless}), {3, 2, 1}).norm(), 0.0);
  EffectSet set;
  set.add("gyroscopic", 0.0);
  const RotorMomentum four = momentum({rotor(1, 945, 0), rotor(1, 945, 0), rotor(-1, 945, 0), rotor(-1, 945, 0)});
  EXPECT_LT(set.moment_B_N_m(four, {6.5, 2, 1}).norm(), 1e-15);
}
TEST(Gyroscopic, DoesNoWork) {
  const Eigen::Vector3d w(3.0, -2.0, 1.0);
  EXPECT_NEAR(kGyroscopic.moment_B_N_m(momentum({rotor(1, 1400, 0)}), w).dot(w), 0.0, 1e-15);
}
TEST(Gyroscopic, IsAbout23MillinewtonmetresAtTenPercentSurplusAnd6p5RadPerSecond) {
  EffectSet set;
  set.add("gyroscopic", 0.0);
  const RotorMomentum four = momentum({rotor(1, 945 * 1.1, 0), rotor(1, 945 * 1.1, 0), rotor(-1, 945 * 0.9, 0), rotor(-1, 945 * 0.9, 0)});
  EXPECT_NEAR(set.moment_B_N_m(four, {6.5, 0, 0}).y(), 0.0231, 0.0005);
}

TEST(RotorBodyInterference, MultipliesTheInPlaneForceAndNothingElse) {
  RotorLoads l = some_loads();
  kRotorBodyInterference.on_rotor_loads(2.5, l);
  EXPECT_LT((l.force_R_N - Eigen::Vector3d(-0.5, 0.125, 1.7)).norm(), 1e-15);
  EXPECT_EQ(l.moment_R_N_m, some_loads().moment_R_N_m);
  EXPECT_EQ(l.shaft_torque_N_m, some_loads().shaft_torque_N_m);
}
TEST(BlockageStrut, TakesTheLossFromTheThrustAndNothingElse) {
  RotorLoads l = some_loads();
  kBlockageStrut.on_rotor_loads(0.08, l);
  EXPECT_LT((l.force_R_N - Eigen::Vector3d(-0.2, 0.05, 1.7 * 0.92)).norm(), 1e-15);
  EXPECT_EQ(l.moment_R_N_m, some_loads().moment_R_N_m);
  EXPECT_EQ(l.shaft_torque_N_m, some_loads().shaft_torque_N_m);
}

TEST(EveryEffect, OnRotorLoadsChangesNothingAtItsNeutralValueAndSomethingAtBothEndsOfItsRange) {
  for (const Effect* e : builtin_effects()) {
    ASSERT_TRUE(e->on_rotor_loads || e->moment_B_N_m) << e->id << " acts nowhere";
    EXPECT_LE(e->parameter.min, e->parameter.neutral) << e->id;
    EXPECT_GE(e->parameter.max, e->parameter.neutral) << e->id;
    EXPECT_LT(e->parameter.min, e->parameter.max) << e->id;
    if (!e->on_rotor_loads) continue;
    for (const double value : {e->parameter.min, e->parameter.neutral, e->parameter.max}) {
      RotorLoads l = some_loads();
      e->on_rotor_loads(value, l);
      EXPECT_TRUE(l.force_R_N.allFinite());
      EXPECT_EQ(l.force_R_N == some_loads().force_R_N, value == e->parameter.neutral) << e->id << " at " << value;
    }
  }
}
TEST(EveryEffect, MomentsAreLinearInRotorInertia) {
  for (const Effect* e : builtin_effects()) {
    if (!e->moment_B_N_m) continue;
    SpinningRotor once = rotor(1, 945, 3000), twice = once;
    twice.inertia_kg_m2 *= 2.0;
    const Eigen::Vector3d w(1, 2, 3), m = e->moment_B_N_m(momentum({once}), w);
    EXPECT_GT(m.norm(), 1e-3) << e->id;
    EXPECT_LT((e->moment_B_N_m(momentum({twice}), w) - 2.0 * m).norm(), 1e-12) << e->id;
  }
}

std::string refusal(std::string_view id, double value) {
  EffectSet set;
  set.add("blockage_strut", 0.05);
  try {
    set.add(id, value);
  } catch (const Error& e) {
    return e.what();
  }
  return "(no error)";
}
TEST(EffectSet, AnUnknownIdIsRefusedWithTheListOfKnownOnes) {
  EXPECT_THAT(refusal("ground_efect", 1.0),
              AllOf(HasSubstr("effect \"ground_efect\" is not known"),
                    HasSubstr("use one of: rotor_body_interference, blockage_strut, rotor_inertia_reaction, gyroscopic")));
}
TEST(EffectSet, AnEffectTwiceOrAValueOutOfRangeIsRefused) {
  EXPECT_THAT(refusal("blockage_strut", 0.05), HasSubstr("switched on twice"));
  EXPECT_THAT(refusal("rotor_body_interference", 25.0), HasSubstr("k_H = 25 is outside 1 to 4"));
  EXPECT_THAT(refusal("rotor_body_interference", std::numeric_limits<double>::quiet_NaN()), HasSubstr("is outside"));
}
TEST(EffectSet, WhatIsSwitchedOffDoesNotAct) {
  EffectSet set;
  RotorLoads l = some_loads();
  set.apply(l);
  EXPECT_EQ(l.force_R_N, some_loads().force_R_N);
  const RotorMomentum r = momentum({rotor(1, 945, 1e4)});
  EXPECT_EQ(set.moment_B_N_m(r, {1, 2, 3}).norm(), 0.0);
}
TEST(EffectSet, TheOrderOfSwitchingOnDoesNotMatter) {
  EffectSet ab, ba;
  ab.add("blockage_strut", 0.08);
  ab.add("rotor_body_interference", 2.5);
  ba.add("rotor_body_interference", 2.5);
  ba.add("blockage_strut", 0.08);
  RotorLoads l1 = some_loads(), l2 = some_loads();
  ab.apply(l1);
  ba.apply(l2);
  EXPECT_EQ(l1.force_R_N, l2.force_R_N);
  EXPECT_EQ(l1.force_R_N.x(), -0.5);
  EXPECT_TRUE(ab.has("blockage_strut"));
  EXPECT_FALSE(ab.has("gyroscopic"));
  EXPECT_EQ(ab.size(), 2u);
}

}  // namespace
}  // namespace rotorloop::sim
