// Values that no flight shows, speeds with a sign, empty columns, and which of two streams is the wrong one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "test/unit/bench/log/check/checked_flights.hpp"

namespace rotorloop::log {
namespace {

using estimate::testing::analytic_flight;
using estimate::testing::AnalyticFlight;
using testing::change;
using testing::find;
using ::testing::HasSubstr;

constexpr double kAlways_s = 1e9;

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

}  // namespace
}  // namespace rotorloop::log
