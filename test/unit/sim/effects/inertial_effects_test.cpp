// Spinning rotors on a turning body: signs per axis and sense of rotation, sizes, no work done.
#include <gtest/gtest.h>

#include "test/unit/sim/effects/fixture.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

constexpr double kJ_kg_m2 = 9.4e-6;
SpinningRotor rotor(int spin, double omega_rad_s, double omega_dot_rad_s2) {
  return {Eigen::Vector3d::UnitZ(), spin, kJ_kg_m2, omega_rad_s, omega_dot_rad_s2};
}
Eigen::Vector3d moment(std::string_view id, std::initializer_list<SpinningRotor> rotors, const Eigen::Vector3d& w_B_rad_s) {
  BodyMotion m;
  m.w_B_rad_s = w_B_rad_s;
  for (const SpinningRotor& r : rotors) m.rotors.add(r);
  return wrench_of(*make(id, 0.0), m).moment_B_N_m;
}
Eigen::Vector3d reaction(const SpinningRotor& r) { return moment("rotor_inertia_reaction", {r}, {1.0, 2.0, 3.0}); }
Eigen::Vector3d gyroscopic(std::initializer_list<SpinningRotor> rotors, const Eigen::Vector3d& w) {
  return moment("gyroscopic", rotors, w);
}

TEST(RotorInertiaReaction, ACounterClockwiseRotorSpeedingUpTurnsTheBodyClockwiseWith94MillinewtonmetresAt1e4) {
  EXPECT_LT((reaction(rotor(1, 900, 1e4)) - Eigen::Vector3d(0, 0, -0.094)).norm(), 1e-15);
  EXPECT_LT((reaction(rotor(-1, 900, 1e4)) - Eigen::Vector3d(0, 0, 0.094)).norm(), 1e-15);
  EXPECT_GT(reaction(rotor(1, 900, -1e4)).z(), 0.0) << "braking turns it the other way";
}
TEST(RotorInertiaReaction, VanishesAtSteadySpeedAndWithoutInertia) {
  EXPECT_EQ(reaction(rotor(1, 1500, 0)).norm(), 0.0);
  SpinningRotor weightless = rotor(1, 900, 1e4);
  weightless.inertia_kg_m2 = 0.0;
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
  EXPECT_LT((gyroscopic({rotor(1, 945, 0)}, roll) - Eigen::Vector3d(0, 6.5 * L, 0)).norm(), 1e-15);
  EXPECT_LT((gyroscopic({rotor(1, 945, 0)}, pitch) - Eigen::Vector3d(-6.5 * L, 0, 0)).norm(), 1e-15);
  EXPECT_LT((gyroscopic({rotor(-1, 945, 0)}, roll) + Eigen::Vector3d(0, 6.5 * L, 0)).norm(), 1e-15);
}
TEST(Gyroscopic, VanishesInYawAtRestWithoutInertiaAndOverEqualPairs) {
  EXPECT_EQ(gyroscopic({rotor(1, 945, 0)}, {0, 0, 3}).norm(), 0.0);
  EXPECT_EQ(gyroscopic({rotor(1, 945, 0)}, {0, 0, 0}).norm(), 0.0);
  SpinningRotor weightless = rotor(1, 945, 0);
  weightless.inertia_kg_m2 = 0.0;
  EXPECT_EQ(gyroscopic({weightless}, {3, 2, 1}).norm(), 0.0);
  EXPECT_LT(gyroscopic({rotor(1, 945, 0), rotor(1, 945, 0), rotor(-1, 945, 0), rotor(-1, 945, 0)}, {6.5, 2, 1}).norm(), 1e-15);
}
TEST(Gyroscopic, DoesNoWork) {
  const Eigen::Vector3d w(3.0, -2.0, 1.0);
  EXPECT_NEAR(gyroscopic({rotor(1, 1400, 0)}, w).dot(w), 0.0, 1e-15);
}
TEST(Gyroscopic, IsAbout23MillinewtonmetresAtTenPercentSurplusAnd6p5RadPerSecond) {
  EXPECT_NEAR(
      gyroscopic({rotor(1, 945 * 1.1, 0), rotor(1, 945 * 1.1, 0), rotor(-1, 945 * 0.9, 0), rotor(-1, 945 * 0.9, 0)}, {6.5, 0, 0}).y(),
      0.0231, 0.0005);
}

TEST(InertialEffects, AreLinearInRotorInertia) {
  SpinningRotor once = rotor(1, 945, 3000), twice = once;
  twice.inertia_kg_m2 *= 2.0;
  for (const auto id : {"rotor_inertia_reaction", "gyroscopic"}) {
    const Eigen::Vector3d m = moment(id, {once}, {1, 2, 3});
    EXPECT_GT(m.norm(), 1e-3) << id;
    EXPECT_LT((moment(id, {twice}, {1, 2, 3}) - 2.0 * m).norm(), 1e-12) << id;
  }
}

}  // namespace
}  // namespace rotorloop::sim
