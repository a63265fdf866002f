// Flatness and attitude error: rates against differences of the attitude itself, signs, and the singular cases.
#include "host/control/attitude.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "host/control/trajectory_generator.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::host {
namespace {

using V3 = Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;

AttitudeSetpoint on(const Setpoint& s, Heading& heading) {
  return flat_attitude(s.a_W_m_s2 + V3(0, 0, kGravity_m_s2), s.j_W_m_s3, s.yaw_rad, s.yaw_rate_rad_s, heading);
}

TEST(Flatness, RatesAreTheDerivativeOfTheAttitudeThroughoutTheGeneralFlight) {
  const Trajectory t = general().trajectory;
  constexpr double h = 1e-5;
  for (double time = 2.05; time < t.last_motion_s(); time += 0.0917) {
    Heading heading;
    const Eigen::Matrix3d before = on(t.at(time - h), heading).R_WB, after = on(t.at(time + h), heading).R_WB;
    const AttitudeSetpoint now = on(t.at(time), heading);
    const Eigen::Matrix3d skew = now.R_WB.transpose() * (after - before) / (2 * h);
    ASSERT_LT((V3(skew(2, 1), skew(0, 2), skew(1, 0)) - now.w_B_rad_s).norm(), 1e-4) << time;
    ASSERT_NEAR(now.R_WB.determinant(), 1.0, 1e-12);
  }
}

TEST(Flatness, ThrustForwardPitchesTheNoseDownAndKeepsTheHeading) {
  Heading heading;
  const AttitudeSetpoint a = flat_attitude({5.0, 0, 9.8}, V3::Zero(), 0.0, 0.0, heading);
  EXPECT_LT((a.R_WB.col(2) - V3(5.0, 0, 9.8).normalized()).norm(), 1e-12);
  EXPECT_LT(a.R_WB(2, 0), 0.0);  // nose points down
  EXPECT_NEAR(a.R_WB(1, 0), 0.0, 1e-12);
  const AttitudeSetpoint turned = flat_attitude({0, 0, 9.8}, V3::Zero(), 0.7, 0.3, heading);
  EXPECT_NEAR(std::atan2(turned.R_WB(1, 0), turned.R_WB(0, 0)), 0.7, 1e-12);
  EXPECT_NEAR(turned.w_B_rad_s.z(), 0.3, 1e-12);
}

TEST(Flatness, NearFreeFallTheLastDirectionIsHeldWithoutRates) {
  Heading heading;
  const V3 tilted(3.0, 0, 9.0);
  flat_attitude(tilted, V3::Zero(), 0.0, 0.0, heading);
  const AttitudeSetpoint a = flat_attitude({0.01, -0.02, 0.0}, {30.0, 0, 0}, 0.0, 0.0, heading);
  EXPECT_TRUE(a.direction_held);
  EXPECT_LT((a.R_WB.col(2) - tilted.normalized()).norm(), 1e-12);
  EXPECT_EQ(a.w_B_rad_s.head<2>().norm(), 0.0);
  EXPECT_TRUE(flat_attitude(V3::Zero(), V3::Zero(), 0.0, 0.0, heading).R_WB.allFinite());
}

TEST(Flatness, ThrustAlongTheHeadingKeepsTheLastSideAxis) {
  Heading heading;
  heading.y_W = V3::UnitY();
  const AttitudeSetpoint a = flat_attitude({10.0, 0, 0.001}, V3::Zero(), 0.0, 1.0, heading);
  EXPECT_TRUE(a.R_WB.allFinite());
  EXPECT_NEAR(a.R_WB.determinant(), 1.0, 1e-9);
  EXPECT_LT((a.R_WB.col(1) - V3::UnitY()).norm(), 1e-3);
  EXPECT_LT(a.w_B_rad_s.norm(), 1e-9);
}

TEST(AttitudeError, SmallAnglesAreTheAnglesThemselves) {
  AttitudeSetpoint level;
  for (int axis = 0; axis < 3; ++axis) {
    const V3 angle = 0.02 * V3::Unit(axis);
    const Eigen::Matrix3d R = Eigen::AngleAxisd(0.02, V3::Unit(axis)).toRotationMatrix();
    EXPECT_LT((attitude_error(R, V3::Zero(), level).angle_rad - angle).norm(), 1e-6);
  }
}

TEST(AttitudeError, KeepsGrowingToHalfATurnWhereTheUsualOneVanishes) {
  const AttitudeSetpoint level;
  double last = 0.0;
  for (double angle = 0.1; angle < kPi - 1e-4; angle += 0.1) {
    const AttitudeError e = attitude_error(Eigen::AngleAxisd(angle, V3::UnitX()).toRotationMatrix(), V3::Zero(), level);
    ASSERT_GT(e.angle_rad.x(), last) << angle;
    ASSERT_NEAR(e.angle_rad.x(), 2.0 * std::sin(0.5 * angle), 1e-9);
    last = e.angle_rad.x();
  }
  const V3 upside_down = attitude_error(Eigen::AngleAxisd(kPi, V3(1, 2, 0).normalized()).toRotationMatrix(), V3::Zero(), level).angle_rad;
  EXPECT_NEAR(upside_down.norm(), 2.0, 1e-6);
  EXPECT_NEAR(std::fabs(upside_down.normalized().dot(V3(1, 2, 0).normalized())), 1.0, 1e-6);
}

TEST(AttitudeError, RateSetpointIsTurnedIntoTheBodysAxes) {
  AttitudeSetpoint s;
  s.R_WB = Eigen::AngleAxisd(kPi / 2, V3::UnitZ()).toRotationMatrix();
  s.w_B_rad_s = {1.0, 0, 0};  // about W's y
  EXPECT_LT((attitude_error(Eigen::Matrix3d::Identity(), {0, 1.0, 0}, s).rate_rad_s).norm(), 1e-12);
}

}  // namespace
}  // namespace rotorloop::host
