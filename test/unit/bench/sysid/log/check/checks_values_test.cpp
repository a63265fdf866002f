// Values that no flight shows, speeds with a sign, empty columns, and which of two streams is the wrong one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "test/unit/bench/sysid/log/check/checked_flights.hpp"

namespace rotorloop::log {
namespace {

using estimate::testing::analytic_flight;
using estimate::testing::AnalyticFlight;
using testing::change;
using testing::find;
using ::testing::HasSubstr;
using testing::kAlways_s;

TEST(Values, BeyondAnyFlightForASecondAreLeftOutAndNoMessageSpeaksOfNothingOrInfinity) {
  for (const char* stream : {"rotor speeds", "gyro", "pose", "velocity", "accelerometer"}) {
    AnalyticFlight f = analytic_flight();
    const std::string name = stream;
    const auto spoil = [](Eigen::Vector3d& v) { v.x() = 1e300; };
    if (name == "rotor speeds") change(f.record.rotor_omega_rad_s, 107.0, 108.0, [](RotorValues& w) { w[0] = 1e300; });
    if (name == "gyro") change(f.record.gyro_B_rad_s, 107.0, 108.0, spoil);
    if (name == "velocity") change(f.record.velocity_W_m_s, 107.0, 108.0, spoil);
    if (name == "accelerometer") change(f.record.accel_B_m_s2, 107.0, 108.0, spoil);
    if (name == "pose") change(f.record.pose, 107.0, 108.0, [](PoseReading& p) { p.p_W_m.x() = 1e300; });
    const CheckedFlight c = check_flight(f.record, f.vehicle);
    ASSERT_FALSE(c.refusal) << findings_table(c);
    const LogFinding* beyond = find(c, name, FindingAction::exclude, "beyond what a flight shows");
    ASSERT_NE(beyond, nullptr) << findings_table(c);
    EXPECT_NEAR(beyond->from_s, 107.0, 0.02);
    EXPECT_NEAR(beyond->to_s, 108.0, 0.02);
    for (const LogFinding& finding : c.findings) {
      EXPECT_EQ(finding.what.find("nan"), std::string::npos) << finding.what;
      EXPECT_EQ(finding.what.find("inf"), std::string::npos) << finding.what;
      EXPECT_LT(finding.what.size(), 250u) << finding.what;
    }
  }
}

TEST(Values, NegativeSpeedsAreRefusedWithTheRotors) {
  AnalyticFlight one = analytic_flight(), all = analytic_flight();
  change(one.record.rotor_omega_rad_s, 0.0, kAlways_s, [](RotorValues& w) { w[2] = -w[2]; });
  change(all.record.rotor_omega_rad_s, 0.0, kAlways_s, [](RotorValues& w) {
    for (double& x : w) x = -x;
  });
  const CheckedFlight c = check_flight(one.record, one.vehicle), d = check_flight(all.record, all.vehicle);
  EXPECT_NE(find(c, "rotor speeds", FindingAction::refuse, "speeds of rotor 3 are negative"), nullptr) << findings_table(c);
  EXPECT_NE(find(d, "rotor speeds", FindingAction::refuse, "speeds of rotor 1, 2, 3, 4 are negative"), nullptr) << findings_table(d);
}

TEST(Values, OfARotorThatNeverReportedAreRefusedWithTheRotor) {
  AnalyticFlight f = analytic_flight();
  change(f.record.rotor_omega_rad_s, 0.0, kAlways_s, [](RotorValues& w) { w[0] = std::numeric_limits<double>::quiet_NaN(); });
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->what, HasSubstr("rotor 1 has none"));
  EXPECT_THAT(c.refusal->remedy, HasSubstr("motor commands"));
}

TEST(Values, PositionInMillimetresIsNotBlamedOnTheVelocityBesideIt) {
  AnalyticFlight f = analytic_flight();
  change(f.record.pose, 0.0, kAlways_s, [](PoseReading& p) { p.p_W_m *= 1000.0; });
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->what, HasSubstr("position"));
  EXPECT_THAT(c.refusal->likely, HasSubstr("position is in mm"));
}

TEST(Values, VelocityInMillimetresPerSecondIsNotBlamedOnThePosition) {
  AnalyticFlight f = analytic_flight();
  change(f.record.velocity_W_m_s, 0.0, kAlways_s, [](Eigen::Vector3d& v) { v *= 1000.0; });
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_EQ(c.refusal->likely, "velocity is in mm/s, read as m/s");
}

TEST(Values, PoseLateByMoreThanTheSearchIsRefusedWithTheOffset) {
  AnalyticFlight f = analytic_flight();
  for (double& t : f.record.pose.t_s) t += 0.2;
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_NE(find(c, "pose", FindingAction::refuse, "stamps +200 ms late against gyro"), nullptr) << findings_table(c);
  EXPECT_THAT(c.refusal->remedy, HasSubstr("time_offset_s = -0.20"));
}

// Half a turn about x: what forward-right-down makes of forward-left-up, and north-east-down of z up.
Eigen::Vector3d turned_over(const Eigen::Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }
const Eigen::Quaterniond kHalfTurn(0.0, 1.0, 0.0, 0.0);

AnalyticFlight with_body_forward_right_down() {
  AnalyticFlight f = analytic_flight();
  for (Eigen::Vector3d& v : f.record.gyro_B_rad_s.value) v = turned_over(v);
  for (Eigen::Vector3d& v : f.record.accel_B_m_s2.value) v = turned_over(v);
  for (PoseReading& p : f.record.pose.value) p.q_WS = p.q_WS * kHalfTurn;
  return f;
}

AnalyticFlight with_world_north_east_down(AnalyticFlight f) {
  for (Eigen::Vector3d& v : f.record.velocity_W_m_s.value) v = turned_over(v);
  for (PoseReading& p : f.record.pose.value) p = {turned_over(p.p_W_m), kHalfTurn * p.q_WS};
  return f;
}

TEST(Axes, OfTheBodyForwardRightDownInAllStreamsAreRefusedWithTheKeyOfTheMapping) {
  const AnalyticFlight f = with_body_forward_right_down();
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->likely, "body axes are forward-right-down");
  EXPECT_THAT(c.refusal->remedy, HasSubstr("body = \"FRD\" in the mapping's [axes]"));
}

TEST(Axes, OfTheWorldNorthEastDownAreRefusedWithTheKeyOfTheMapping) {
  const AnalyticFlight f = with_world_north_east_down(analytic_flight());
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->likely, "world axes are north-east-down");
  EXPECT_THAT(c.refusal->remedy, HasSubstr("world = \"NED\" in the mapping's [axes]"));
}

TEST(Axes, OfWorldAndBodyBothPointingDownAreRefusedWithBothKeys) {
  AnalyticFlight f = with_world_north_east_down(with_body_forward_right_down());
  const CheckedFlight with_accel = check_flight(f.record, f.vehicle);
  f.record.accel_B_m_s2 = {};
  const CheckedFlight without = check_flight(f.record, f.vehicle);
  for (const CheckedFlight* c : {&with_accel, &without}) {
    ASSERT_TRUE(c->refusal) << findings_table(*c);
    EXPECT_THAT(c->refusal->remedy, HasSubstr("world = \"NED\" and body = \"FRD\"")) << findings_table(*c);
  }
}

TEST(Axes, OfThePositionAloneNorthEastDownAreRefusedAsThePositions) {
  AnalyticFlight f = analytic_flight();
  for (PoseReading& p : f.record.pose.value) p.p_W_m = turned_over(p.p_W_m);
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->likely, HasSubstr("the position is north-east-down")) << findings_table(c);
}

TEST(Battery, InMillivoltsReadAsVoltsOrTheOtherWayIsRefusedWithTheUnitToGive) {
  AnalyticFlight milli = analytic_flight(), volts = analytic_flight();
  for (double& v : milli.record.battery_V.value) v *= 1000.0;
  for (double& v : volts.record.battery_V.value) v *= 0.001;
  const CheckedFlight a = check_flight(milli.record, milli.vehicle), b = check_flight(volts.record, volts.vehicle);
  ASSERT_TRUE(a.refusal && b.refusal) << findings_table(a) << findings_table(b);
  EXPECT_THAT(a.refusal->likely, HasSubstr("the log has mV, the mapping says V (then 15.84 V)"));
  EXPECT_THAT(a.refusal->remedy, HasSubstr("unit = \"mV\""));
  EXPECT_THAT(b.refusal->remedy, HasSubstr("unit = \"V\""));
}

}  // namespace
}  // namespace rotorloop::log
