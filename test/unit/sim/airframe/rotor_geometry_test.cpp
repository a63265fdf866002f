// Signs, per axis and per rotor: which way a hub moves through the air, and which way its loads turn the body.
#include <gtest/gtest.h>

#include "test/unit/sim/airframe/fixture.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

constexpr Four kStopped{0, 0, 0, 0};

Eigen::Vector3d angular_acceleration(const AirframeConfig& c, const FourLoads& loads) {
  Airframe a(c, at_height(0.0));
  a.step(loads, kStopped, kStopped);
  return a.state().w_B_rad_s / (static_cast<double>(c.step_ns) * 1e-9);
}

TEST(RotorCondition, HubVelocityUnderEachBodyRateHasTheSignOfItsPlace) {
  // Worked out by hand from v = w x r, r = (+-0.0885, +-0.0885, 0.02): rows rotor 1 to 4, 1 rad/s.
  const Eigen::Vector3d roll[4] = {{0, -kHeight_m, -kArm_m}, {0, -kHeight_m, kArm_m}, {0, -kHeight_m, kArm_m}, {0, -kHeight_m, -kArm_m}};
  const Eigen::Vector3d pitch[4] = {{kHeight_m, 0, -kArm_m}, {kHeight_m, 0, kArm_m}, {kHeight_m, 0, -kArm_m}, {kHeight_m, 0, kArm_m}};
  const Eigen::Vector3d yaw[4] = {{kArm_m, kArm_m, 0}, {-kArm_m, -kArm_m, 0}, {-kArm_m, kArm_m, 0}, {kArm_m, -kArm_m, 0}};
  for (int axis = 0; axis < 3; ++axis) {
    AirframeState s;
    s.w_B_rad_s = Eigen::Vector3d::Unit(axis);
    // A tilted attitude must not matter: rates and arms are both in the body frame.
    s.q_WB = Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5);
    const Airframe a(reference_body(), s);
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector3d& expected = (axis == 0 ? roll : axis == 1 ? pitch : yaw)[i];
      const RotorCondition c = a.rotor_condition(i, 900.0);
      EXPECT_LT((c.v_R_m_s - expected).norm(), 1e-15) << "axis " << axis << " rotor " << i + 1;
      EXPECT_EQ(c.w_R_rad_s, s.w_B_rad_s);
      EXPECT_EQ(c.spin, i < 2 ? 1 : -1);
      EXPECT_EQ(c.omega_rad_s, 900.0);
      EXPECT_EQ(c.density_kg_m3, 1.2);
    }
  }
}

TEST(RotorCondition, ClimbIsPositiveAndWindBlowsAgainstIt) {
  AirframeConfig c = reference_body();
  c.wind_W_m_s = {5.0, 0.0, 0.0};
  AirframeState s;
  s.v_W_m_s = {5.0, 0.0, 3.0};
  EXPECT_LT((Airframe(c, s).rotor_condition(0, 900.0).v_R_m_s - Eigen::Vector3d(0, 0, 3)).norm(), 1e-15);
}

TEST(RotorCondition, VelocityIsSeenInTheBodyFrame) {
  AirframeState s;
  s.v_W_m_s = {7.0, 0.0, 0.0};
  s.q_WB = Eigen::Quaterniond(std::sqrt(0.5), 0, 0, std::sqrt(0.5));  // nose to the left (world y)
  EXPECT_LT((Airframe(reference_body(), s).rotor_condition(2, 900.0).v_R_m_s - Eigen::Vector3d(0, -7, 0)).norm(), 1e-14);
}

TEST(RotorLoads, ThrustOfOneRotorRollsAndPitchesAsEquationThreeSays) {
  AirframeConfig c = reference_body();
  const double dx = 0.0014, dy = 0.0002, T = 1.7, l = kArm_m;
  c.com_offset_m = {dx, dy, 0.0};
  // Rows of paper eq. (3): moment about x and y per newton of rotors 1 to 4.
  const double roll_m[4] = {-(l + dy), l - dy, l - dy, -(l + dy)};
  const double pitch_m[4] = {-(l - dx), l + dx, -(l - dx), l + dx};
  for (std::size_t i = 0; i < 4; ++i) {
    FourLoads loads{};
    loads[i].force_R_N.z() = T;
    const Eigen::Vector3d w_dot = angular_acceleration(c, loads);
    EXPECT_NEAR(w_dot.x(), roll_m[i] * T / 2.41e-3, 0.01) << "rotor " << i + 1;
    EXPECT_NEAR(w_dot.y(), pitch_m[i] * T / 3.42e-3, 0.01) << "rotor " << i + 1;
    EXPECT_NEAR(w_dot.z(), 0.0, 0.05) << "rotor " << i + 1;
  }
}

TEST(RotorLoads, ReactionTorqueOfRotorsOneAndTwoIsAlongMinusZ) {
  for (std::size_t i = 0; i < 4; ++i) {
    Airframe a(reference_body(), at_height(0.0));
    FourLoads loads{};
    loads[i] = analytic_rotor(a.rotor_condition(i, 945.0));
    loads[i].force_R_N.setZero();
    a.step(loads, kStopped, kStopped);
    const double torque_N_m = 0.016 * 1.9e-6 * 945.0 * 945.0;
    EXPECT_NEAR(a.state().w_B_rad_s.z() / 5e-4, (i < 2 ? -1.0 : 1.0) * torque_N_m / 5.22e-3, 1e-9) << "rotor " << i + 1;
  }
}

TEST(RotorLoads, InPlaneForceAboveTheCentreOfMassPitchesAndRolls) {
  FourLoads back{}, left{};
  for (auto& l : back) l.force_R_N.x() = -0.25;
  for (auto& l : left) l.force_R_N.y() = 0.25;
  EXPECT_NEAR(angular_acceleration(reference_body(), back).y(), -1.0 * kHeight_m / 3.42e-3, 1e-9);  // nose up
  EXPECT_NEAR(angular_acceleration(reference_body(), left).x(), -1.0 * kHeight_m / 2.41e-3, 1e-9);
}

TEST(RotorLoads, CentreOfMass1p4MillimetresAheadPitchesTheNoseDownWith9MillinewtonmetresInHover) {
  AirframeConfig c = reference_body();
  c.com_offset_m = {0.0014, 0.0, 0.0};
  FourLoads loads{};
  for (auto& l : loads) l.force_R_N.z() = kMass_kg * kGravity_m_s2 / 4.0;
  EXPECT_NEAR(angular_acceleration(c, loads).y() * 3.42e-3, 0.0014 * kMass_kg * kGravity_m_s2, 1e-6);
}

TEST(RotorTilt, OneDegreeLeansOnePointSevenPercentOfTheThrust) {
  const double deg = 3.14159265358979 / 180.0;
  const struct {
    Eigen::Vector2d tilt_rad;
    Eigen::Vector3d expected_N;
  } cases[] = {
      {{1.0 * deg, 0.0}, {0.0, -0.017452, 0.99985}},  // to the right
      {{0.0, 1.0 * deg}, {0.017452, 0.0, 0.99985}},   // forward
  };
  for (const auto& k : cases) {
    AirframeConfig c = reference_body();
    c.rotors[0].tilt_rad = k.tilt_rad;
    Airframe a(c, at_height(0.0));
    FourLoads loads{};
    loads[0].force_R_N.z() = 1.0;
    a.step(loads, kStopped, kStopped);
    EXPECT_LT((a.wrench().rotor_force_B_N - k.expected_N).norm(), 1e-5);
  }
}

TEST(RotorTilt, ATiltedRotorSeesClimbPartlyAsEdgewiseFlow) {
  AirframeConfig c = reference_body();
  c.rotors[0].tilt_rad = {0.0, 0.1};
  AirframeState s;
  s.v_W_m_s = {0.0, 0.0, 2.0};
  const Eigen::Vector3d v = Airframe(c, s).rotor_condition(0, 900.0).v_R_m_s;
  EXPECT_NEAR(v.x(), -2.0 * std::sin(0.1), 1e-12);
  EXPECT_NEAR(v.z(), 2.0 * std::cos(0.1), 1e-12);
}

}  // namespace
}  // namespace rotorloop::sim
