// What one rotor may do that the others do not, and the extra loads of a rotor in edgewise flow: signs by rotor and spin, sizes,
// what stays.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "test/unit/sim/effects/fixture.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;
using Vec = Eigen::Vector3d;
using Options = std::vector<std::pair<std::string_view, double>>;

BodyMotion rotor_in_air(const Vec& v_air_B_m_s, double time_s = 0.0) {
  BodyMotion m;
  m.time_s = time_s;
  m.v_air_B_m_s = v_air_B_m_s;
  m.density_kg_m3 = 1.2;
  return m;
}
RotorLoads after(std::string_view id, double value, std::size_t rotor, const BodyMotion& m, const Options& options = {},
                 double omega = 945.0) {
  RotorLoads l = some_loads();
  make(id, value, options)->rotor_loads(site(rotor, m, omega), l);
  return l;
}
bool untouched(const RotorLoads& l) {
  const RotorLoads s = some_loads();
  return l.force_R_N == s.force_R_N && l.moment_R_N_m == s.moment_R_N_m && l.shaft_torque_N_m == s.shaft_torque_N_m;
}
Vec added_moment(std::string_view id, double value, std::size_t rotor, const BodyMotion& m, double omega = 945.0) {
  return after(id, value, rotor, m, {}, omega).moment_R_N_m - some_loads().moment_R_N_m;
}
Vec added_force(std::string_view id, double value, std::size_t rotor, const BodyMotion& m, double omega = 945.0) {
  return after(id, value, rotor, m, {}, omega).force_R_N - some_loads().force_R_N;
}

TEST(RotorRollingMoment, LowersTheRetreatingSideWithAbout8MillinewtonmetresAt8p5) {
  const BodyMotion forward = rotor_in_air({8.5, 0, 0});
  EXPECT_NEAR(added_moment("rotor_rolling_moment", 1e-6, 0, forward).x(), -8.0e-3, 0.1e-3)
      << "counter-clockwise: right side advances, lifts";
  EXPECT_NEAR(added_moment("rotor_rolling_moment", 1e-6, 2, forward).x(), 8.0e-3, 0.1e-3) << "clockwise: left side advances";
  EXPECT_NEAR(added_moment("rotor_rolling_moment", 1e-6, 0, rotor_in_air({0, 8.5, 0})).y(), -8.0e-3, 0.1e-3);
}
// The solve has a rolling moment of its own; the effect adds to it, with the same sign.
TEST(RotorRollingMoment, HasTheSignOfTheBladeElementSolve) {
  for (std::size_t i = 0; i < 4; ++i)
    for (const Vec& v : {Vec(8, 0, 0), Vec(0, 8, 0), Vec(-8, 0, 0)}) {
      const BodyMotion m = rotor_in_air(v);
      EXPECT_GT(added_moment("rotor_rolling_moment", 1e-6, i, m).dot(solved(site(i, m)).moment_R_N_m), 0.0);
    }
}
TEST(RotorRollingMoment, CancelsOverFourEqualRotorsAndNotUnderYawTorque) {
  const BodyMotion m = rotor_in_air({8.5, 2, 0});
  Vec equal = Vec::Zero(), yawing = Vec::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    equal += added_moment("rotor_rolling_moment", 1e-6, i, m);
    yawing += added_moment("rotor_rolling_moment", 1e-6, i, m, i < 2 ? 945.0 * 1.1 : 945.0 * 0.9);
  }
  EXPECT_LT(equal.norm(), 1e-15);
  EXPECT_GT(yawing.norm(), 3e-3);
}
TEST(RotorRollingMoment, LeavesForcesAndTorque) {
  const RotorLoads l = after("rotor_rolling_moment", 5e-6, 1, rotor_in_air({8, 3, 1}));
  EXPECT_EQ(l.force_R_N, some_loads().force_R_N);
  EXPECT_EQ(l.moment_R_N_m.z(), some_loads().moment_R_N_m.z());
}

TEST(LateralFlapping, PushesACounterClockwiseRotorToTheLeftOfItsMotion) {
  EXPECT_GT(added_force("lateral_flapping", 2e-6, 0, rotor_in_air({8.5, 0, 0})).y(), 0.0);
  EXPECT_LT(added_force("lateral_flapping", 2e-6, 2, rotor_in_air({8.5, 0, 0})).y(), 0.0);
  EXPECT_LT(added_force("lateral_flapping", 2e-6, 0, rotor_in_air({0, 8.5, 0})).x(), 0.0);
}
TEST(LateralFlapping, ADiskThatLeans0p44DegreesAt15MetresPerSecondIsAbout0p9e6) {
  const double lean_deg = added_force("lateral_flapping", 0.9e-6, 0, rotor_in_air({15, 0, 0})).y() / 1.69 * 180.0 / std::numbers::pi;
  EXPECT_NEAR(lean_deg, 0.44, 0.02);
}
TEST(LateralFlapping, StandsAcrossTheMotionSoItDoesNoWorkAndCancelsOverEqualRotors) {
  const BodyMotion m = rotor_in_air({8, -3, 1});
  Vec sum = Vec::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec f = added_force("lateral_flapping", 1e-5, i, m);
    EXPECT_NEAR(f.dot(m.v_air_B_m_s), 0.0, 1e-15);
    sum += f;
  }
  EXPECT_LT(sum.norm(), 1e-15);
}

TEST(WeakRotor, TakesThrustFromTheNamedRotorAlone) {
  for (std::size_t i = 0; i < 4; ++i) {
    const RotorLoads l = after("weak_rotor", -0.1, i, some_motion(), {{"rotor", 3.0}});
    if (i != 2) {
      EXPECT_TRUE(untouched(l)) << i;
      continue;
    }
    EXPECT_DOUBLE_EQ(l.force_R_N.z(), 0.9 * some_loads().force_R_N.z());
    EXPECT_EQ(l.shaft_torque_N_m, some_loads().shaft_torque_N_m);
    EXPECT_EQ(l.force_R_N.x(), some_loads().force_R_N.x());
  }
}
TEST(WeakRotor, AFrontRightRotorThatLosesFourPercentOfHoverThrustRollsAndPitchesBy6MillinewtonmetresTowardsIt) {
  const BodyMotion hover = rotor_in_air(Vec::Zero());
  const RotorSite s = site(0, hover);
  const Vec moment = s.hub_B_m.cross(added_force("weak_rotor", -0.04, 0, hover));
  EXPECT_NEAR(moment.x(), 6.0e-3, 0.1e-3) << "right side down";
  EXPECT_NEAR(moment.y(), 6.0e-3, 0.1e-3) << "nose down";
}
TEST(WeakRotor, TorqueFollowsByItsShare) {
  const RotorLoads l = after("weak_rotor", -0.2, 0, some_motion(), {{"torque_share", 0.5}});
  EXPECT_DOUBLE_EQ(l.shaft_torque_N_m, 0.9 * some_loads().shaft_torque_N_m);
  EXPECT_DOUBLE_EQ(l.moment_R_N_m.z(), 0.9 * some_loads().moment_R_N_m.z());
}
TEST(WeakRotor, BreaksAtItsTime) {
  EXPECT_TRUE(untouched(after("weak_rotor", -0.2, 0, rotor_in_air({5, 0, 0}, 9.9995), {{"from_s", 10.0}})));
  EXPECT_FALSE(untouched(after("weak_rotor", -0.2, 0, rotor_in_air({5, 0, 0}, 10.0), {{"from_s", 10.0}})));
}

TEST(ThrustDrift, LosesSixPerCentInAMinuteAtAThousandthASecondOnEveryRotorAndNothingAtTheStart) {
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_TRUE(untouched(after("thrust_drift", -1e-3, i, rotor_in_air({5, 0, 0}, 0.0)))) << i;
    const RotorLoads l = after("thrust_drift", -1e-3, i, rotor_in_air({5, 0, 0}, 60.0));
    EXPECT_NEAR(l.force_R_N.z(), 0.94 * some_loads().force_R_N.z(), 1e-12) << i;
    EXPECT_EQ(l.shaft_torque_N_m, some_loads().shaft_torque_N_m) << i;
  }
}
TEST(RotorThrustDrift, LosesItOnTheNamedRotorAloneAndNeverPulls) {
  const BodyMotion late = rotor_in_air({5, 0, 0}, 60.0);
  EXPECT_TRUE(untouched(after("rotor_thrust_drift", -1e-3, 0, late, {{"rotor", 2.0}})));
  EXPECT_NEAR(after("rotor_thrust_drift", -1e-3, 1, late, {{"rotor", 2.0}}).force_R_N.z(), 0.94 * some_loads().force_R_N.z(), 1e-12);
  EXPECT_EQ(after("rotor_thrust_drift", -0.02, 1, late, {{"rotor", 2.0}}).force_R_N.z(), 0.0);
}

TEST(RotorTorqueScale, ScalesShaftTorqueAndItsReactionOfTheNamedRotorAlone) {
  const RotorLoads l = after("rotor_torque_scale", 0.2, 1, some_motion(), {{"rotor", 2.0}});
  EXPECT_DOUBLE_EQ(l.shaft_torque_N_m, 1.2 * some_loads().shaft_torque_N_m);
  EXPECT_DOUBLE_EQ(l.moment_R_N_m.z(), 1.2 * some_loads().moment_R_N_m.z());
  EXPECT_EQ(l.force_R_N, some_loads().force_R_N);
  EXPECT_TRUE(untouched(after("rotor_torque_scale", 0.2, 0, some_motion(), {{"rotor", 2.0}})));
}

// One second of hover at 2 kHz: the added force of each step.
std::vector<Vec> turned(Effect& effect, std::size_t rotor, double omega_rad_s, double omega_dot_rad_s2 = 0.0) {
  std::vector<Vec> forces;
  for (int step = 0; step < 2000; ++step) {
    const BodyMotion m = rotor_in_air(Vec::Zero(), 5e-4 * step);
    RotorSite s = site(rotor, m, omega_rad_s + omega_dot_rad_s2 * 5e-4 * step);
    s.omega_dot_rad_s2 = omega_dot_rad_s2;
    RotorLoads l = some_loads();
    effect.rotor_loads(s, l);
    forces.push_back(l.force_R_N - some_loads().force_R_N);
    effect.advance(m, 5e-4);
  }
  return forces;
}
double angle_turned(const std::vector<Vec>& f) {
  double sum = 0.0;
  for (std::size_t i = 1; i < f.size(); ++i) sum += std::atan2(f[i - 1].x() * f[i].y() - f[i - 1].y() * f[i].x(), f[i - 1].dot(f[i]));
  return sum;
}

TEST(RotorImbalance, TurnsWithTheRotorInItsSenseWithMassTimesRadiusTimesSpeedSquared) {
  for (const std::size_t rotor : {std::size_t{0}, std::size_t{2}}) {
    const auto effect = make("rotor_imbalance", 5e-7, {{"rotor", static_cast<double>(rotor + 1)}});
    const auto forces = turned(*effect, rotor, 945.0);
    for (const Vec& f : forces) {
      EXPECT_NEAR(f.norm(), 0.4465, 1e-4);
      EXPECT_EQ(f.z(), 0.0);
    }
    EXPECT_NEAR(angle_turned(forces), (rotor == 0 ? 1.0 : -1.0) * 945.0 * 1999 * 5e-4, 1e-6) << "150 turns a second";
  }
}
TEST(RotorImbalance, AveragesToNothingOverATurn) {
  const auto effect = make("rotor_imbalance", 5e-7);
  Vec sum = Vec::Zero();
  for (const Vec& f : turned(*effect, 0, 945.0)) sum += f;
  EXPECT_LT(sum.norm() / 2000, 1e-3);
}
TEST(RotorImbalance, KeepsItsPhaseThroughChangesOfSpeed) {
  const auto effect = make("rotor_imbalance", 5e-7);
  const double t_s = 1999 * 5e-4;
  EXPECT_NEAR(angle_turned(turned(*effect, 0, 600.0, 500.0)), 600.0 * t_s + 0.5 * 500.0 * t_s * t_s, 1e-6);
}
TEST(RotorImbalance, OtherRotorsAndAStoppedOneAreStill) {
  EXPECT_TRUE(untouched(after("rotor_imbalance", 1e-5, 1, some_motion())));
  EXPECT_TRUE(untouched(after("rotor_imbalance", 1e-5, 0, some_motion(), {}, 0.0)));
}
TEST(RotorImbalance, AMissingPieceCostsThrustToo) {
  EXPECT_DOUBLE_EQ(after("rotor_imbalance", 5e-7, 0, some_motion(), {{"thrust_loss", 0.04}}).force_R_N.z(),
                   0.96 * some_loads().force_R_N.z());
}

// Loads of round numbers that step up by half at the second call; the answer after `calls` more steps of 0.5 ms.
RotorLoads after_step(double tau_s, int calls) {
  const auto effect = make("thrust_lag", tau_s);
  RotorLoads l;
  for (int i = 0; i <= calls; ++i) {
    const BodyMotion m = rotor_in_air({5, 0, 0}, 5e-4 * i);
    l = some_loads();
    if (i > 0) {
      l.force_R_N *= 1.5;
      l.moment_R_N_m *= 1.5;
      l.shaft_torque_N_m *= 1.5;
    }
    effect->rotor_loads(site(0, m), l);
  }
  return l;
}
TEST(ThrustLag, StartsFromTheSteadyLoadsAndReaches63PercentOfAStepAfterTau) {
  EXPECT_TRUE(untouched(after_step(0.02, 0)));
  const RotorLoads l = after_step(0.02, 40);
  const double share = 1.0 - std::exp(-1.0);
  EXPECT_NEAR(l.force_R_N.z() / some_loads().force_R_N.z(), 1.0 + 0.5 * share, 1e-9);
  EXPECT_NEAR(l.force_R_N.x() / some_loads().force_R_N.x(), 1.0 + 0.5 * share, 1e-9);
  EXPECT_NEAR(l.moment_R_N_m.y() / some_loads().moment_R_N_m.y(), 1.0 + 0.5 * share, 1e-9);
  EXPECT_NEAR(l.shaft_torque_N_m / some_loads().shaft_torque_N_m, 1.0 + 0.5 * share, 1e-9);
}
TEST(ThrustLag, SettlesOnTheSteadyLoads) { EXPECT_NEAR(after_step(0.005, 400).force_R_N.z(), 1.5 * some_loads().force_R_N.z(), 1e-9); }
TEST(ThrustLag, VanishesWithTau) {
  EXPECT_EQ(after_step(0.0, 1).force_R_N, 1.5 * some_loads().force_R_N);
  EXPECT_NEAR(after_step(1e-5, 1).force_R_N.z(), 1.5 * some_loads().force_R_N.z(), 1e-9);
}
TEST(ThrustLag, KeepsTheRotorsApart) {
  const auto effect = make("thrust_lag", 0.05);
  const BodyMotion m = rotor_in_air({5, 0, 0});
  RotorLoads strong = some_loads(), other = some_loads();
  strong.force_R_N *= 2.0;
  effect->rotor_loads(site(0, m), strong);
  effect->rotor_loads(site(1, m), other);
  EXPECT_EQ(other.force_R_N, some_loads().force_R_N);
}

}  // namespace
}  // namespace rotorloop::sim
