// What the blade-element model already has and a plant can take out: local inflow, axial inflow, translational lift, torque in
// motion, rotor drag. Sizes are those of the reference quadrotor at the speed that holds it in hover.
#include <gtest/gtest.h>

#include "test/unit/sim/effects/vehicle.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

// Of the share that is there, relative to the rotor without the effect.
double gained_thrust(std::string_view id, const Eigen::Vector3d& v_m_s) {
  return 1.0 / thrust_ratio(*prepared(id, 0.0), flying(v_m_s)) - 1.0;
}

Wrench turning(const Eigen::Vector3d& w_B_rad_s, double share) {
  BodyMotion m = flying({0, 0, 0});
  m.w_B_rad_s = w_B_rad_s;
  return sum(four_loads(*prepared("rotor_local_inflow", share), m));
}
TEST(RotorLocalInflow, DampsRollAndPitchInHoverByAbout1p7MillinewtonmetreSeconds) {
  EXPECT_GT(turning({1, 0, 0}, 1.0).moment_B_N_m.x(), -2.0 * 1.7e-3);
  EXPECT_LT(turning({1, 0, 0}, 1.0).moment_B_N_m.x(), -0.5 * 1.7e-3);
  EXPECT_NEAR(turning({0, 1, 0}, 1.0).moment_B_N_m.y(), turning({1, 0, 0}, 1.0).moment_B_N_m.x(), 1e-6);
}
TEST(RotorLocalInflow, TakenOutLeavesNoDampingAndItsShareScalesIt) {
  EXPECT_NEAR(turning({1, 0, 0}, 0.0).moment_B_N_m.norm(), 0.0, 1e-12);
  EXPECT_NEAR(turning({1, 0, 0}, 0.5).moment_B_N_m.x() / turning({1, 0, 0}, 1.0).moment_B_N_m.x(), 0.5, 0.02);
  EXPECT_NEAR(turning({1, 0, 0}, 1.3).moment_B_N_m.x() / turning({1, 0, 0}, 1.0).moment_B_N_m.x(), 1.3, 0.03);
}
TEST(RotorLocalInflow, OpposesTheRateWhateverItsSign) {
  for (const double rate : {-3.0, -0.5, 0.5, 3.0}) {
    EXPECT_LT(turning({rate, 0, 0}, 1.0).moment_B_N_m.x() * rate, 0.0) << rate;
    EXPECT_LT(turning({0, rate, 0}, 1.0).moment_B_N_m.y() * rate, 0.0) << rate;
  }
}
TEST(RotorLocalInflow, TakenOutLeavesTheMotionOfTheCentreOfMassAndTheYawRateThatTurnsTheBlades) {
  const BodyMotion m = some_motion();
  for (std::size_t i = 0; i < 4; ++i) {
    RotorCondition c = site(i, m).condition;
    prepared("rotor_local_inflow", 0.0)->rotor_condition(site(i, m), c);
    EXPECT_LT((c.v_R_m_s - m.v_air_B_m_s).norm(), 1e-14);
    EXPECT_EQ(c.w_R_rad_s, Eigen::Vector3d(0, 0, m.w_B_rad_s.z()));
  }
}

TEST(AxialInflow, CostsAbout11PercentOfThrustInAClimbAt3p1MetresPerSecond) {
  EXPECT_LT(gained_thrust("axial_inflow", {0, 0, 3.1}), -0.11 / 2);
  EXPECT_GT(gained_thrust("axial_inflow", {0, 0, 3.1}), -0.11 * 2);
}
// Momentum theory alone would give 9 % at 3.1 m/s. There the solve is inside the measured curve of the ring state already (from
// 0.2 v_h), which takes half of it back.
TEST(AxialInflow, GainsAbout4PercentInDescentAt3p1MetresPerSecondAndTheSlopeOfTheClimbBelow1) {
  EXPECT_NEAR(gained_thrust("axial_inflow", {0, 0, -3.1}), 0.041, 0.005);
  EXPECT_NEAR(gained_thrust("axial_inflow", {0, 0, -1.0}) / gained_thrust("axial_inflow", {0, 0, 1.0}), -1.0, 0.15);
}
TEST(AxialInflow, ScalesTheVelocityAlongTheShaftAlone) {
  const BodyMotion m = some_motion();
  const RotorSite s = site(1, m);
  RotorCondition c = s.condition;
  prepared("axial_inflow", 0.4)->rotor_condition(s, c);
  EXPECT_EQ(c.v_R_m_s, Eigen::Vector3d(s.condition.v_R_m_s.x(), s.condition.v_R_m_s.y(), 0.4 * s.condition.v_R_m_s.z()));
  EXPECT_EQ(c.w_R_rad_s, s.condition.w_R_rad_s);
  EXPECT_NEAR(gained_thrust("axial_inflow", {8.5, 0, 0}), 0.0, 1e-12);
}

TEST(TranslationalLift, IsAbout3p3And12p5And17And20PercentOfThrustAt4And8p5And10p5And12MetresPerSecond) {
  for (const auto& [speed_m_s, size] : {std::pair{4.0, 0.033}, {8.5, 0.125}, {10.5, 0.17}, {12.0, 0.20}}) {
    EXPECT_GT(gained_thrust("translational_lift", {speed_m_s, 0, 0}), size / 1.25) << speed_m_s;
    EXPECT_LT(gained_thrust("translational_lift", {speed_m_s, 0, 0}), size * 1.25) << speed_m_s;
  }
}
TEST(TranslationalLift, KnowsNoPreferredDirectionAndVanishesInVerticalFlight) {
  const double ahead = gained_thrust("translational_lift", {8.5, 0, 0});
  EXPECT_NEAR(gained_thrust("translational_lift", {-8.5, 0, 0}), ahead, 1e-9);
  EXPECT_NEAR(gained_thrust("translational_lift", {0, 8.5, 0}), ahead, 1e-9);
  for (const double climb : {-2.0, 0.0, 3.0}) EXPECT_NEAR(gained_thrust("translational_lift", {0, 0, climb}), 0.0, 1e-10) << climb;
}
TEST(TranslationalLift, AShareTakesThatMuchOfTheDifferenceAndNothingButThrust) {
  const BodyMotion m = some_motion();
  const RotorLoads all = solved(site(1, m)), none = loads_with(*prepared("translational_lift", 0.0), site(1, m));
  const RotorLoads quarter = loads_with(*prepared("translational_lift", 0.25), site(1, m));
  EXPECT_NEAR(thrust_N(quarter), 0.75 * thrust_N(none) + 0.25 * thrust_N(all), 1e-12);
  EXPECT_EQ(largest_change_beside_thrust(none, all), 0.0);
}

TEST(TorqueAdvance, TakenOutLeavesTheTorqueOfHoverWhateverTheMotion) {
  const double hover_N_m = solved(site(0, flying({0, 0, 0}), hover_omega())).shaft_torque_N_m;
  for (const Eigen::Vector3d& v : {Eigen::Vector3d(8.5, 0, 0), Eigen::Vector3d(0, -4, 2), Eigen::Vector3d(3, 3, -2)}) {
    const BodyMotion m = flying(v);
    for (std::size_t i = 0; i < 4; ++i) {
      const RotorSite s = site(i, m, hover_omega());
      const RotorLoads l = loads_with(*prepared("torque_advance", 0.0), s);
      EXPECT_NEAR(l.shaft_torque_N_m, hover_N_m, 1e-10);
      EXPECT_NEAR(l.moment_R_N_m.z(), -s.condition.spin * hover_N_m, 1e-10) << "the reaction has the sign of the spin";
      EXPECT_EQ(l.force_R_N, solved(s).force_R_N);
    }
  }
}
// The 9 % of the survey are of the profile torque alone, about half of the torque; induced power falls at the same time.
TEST(TorqueAdvance, RaisesTheTorqueByAbout4PercentAt8p5And10PercentAt12MetresPerSecond) {
  const double hover_N_m = solved(site(0, flying({0, 0, 0}), hover_omega())).shaft_torque_N_m;
  EXPECT_NEAR(solved(site(0, flying({8.5, 0, 0}), hover_omega())).shaft_torque_N_m / hover_N_m - 1.0, 0.044, 0.01);
  EXPECT_NEAR(solved(site(0, flying({12, 0, 0}), hover_omega())).shaft_torque_N_m / hover_N_m - 1.0, 0.105, 0.02);
}

TEST(RotorDrag, IsAbout1NewtonOverFourRotorsAt8p5MetresPerSecondAgainstTheMotion) {
  const Wrench ahead = sum(four_bare_loads(flying({8.5, 0, 0})));
  EXPECT_LT(ahead.force_B_N.x(), -1.01 / 2);
  EXPECT_GT(ahead.force_B_N.x(), -1.01 * 2);
  EXPECT_NEAR(ahead.force_B_N.y(), 0.0, 1e-9) << "sideways forces of the two spins cancel";
  EXPECT_NEAR(sum(four_bare_loads(flying({0, 8.5, 0}))).force_B_N.y(), ahead.force_B_N.x(), 1e-9);
}
TEST(RotorDrag, IsScaledByItsShareWithThrustAndTorqueUntouched) {
  const BodyMotion m = some_motion();
  const RotorLoads bare = solved(site(2, m));
  for (const double share : {0.0, 0.5, 2.0}) {
    const RotorLoads l = loads_with(*prepared("rotor_drag", share), site(2, m));
    EXPECT_LT((l.force_R_N.head<2>() - share * bare.force_R_N.head<2>()).norm(), 1e-15) << share;
    EXPECT_EQ(thrust_N(l), thrust_N(bare));
    EXPECT_EQ(l.moment_R_N_m, bare.moment_R_N_m);
  }
}

}  // namespace
}  // namespace rotorloop::sim
