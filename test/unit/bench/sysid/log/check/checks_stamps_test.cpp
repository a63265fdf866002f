// Stamps that are no clock of a flight: wild ones, a wrong unit, a clock that was set back. Told before any grid is laid over them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host/base/error.hpp"
#include "test/unit/bench/sysid/log/check/checked_flights.hpp"

namespace rotorloop::log {
namespace {

using estimate::testing::analytic_flight;
using estimate::testing::AnalyticFlight;
using testing::change;
using testing::find;
using ::testing::HasSubstr;

void scale_stamps(FlightRecord& r, double factor) {
  for (auto* t : {&r.pose.t_s, &r.velocity_W_m_s.t_s, &r.gyro_B_rad_s.t_s, &r.accel_B_m_s2.t_s, &r.rotor_omega_rad_s.t_s, &r.battery_V.t_s})
    for (double& x : *t) x *= factor;
}

TEST(Stamps, WildOnesAtTheEndsAreLeftOutWhateverTheyRead) {
  for (const double wild : {1e5, 1e9, 1e300}) {
    AnalyticFlight f = analytic_flight();
    f.record.gyro_B_rad_s.t_s.back() = wild;
    f.record.accel_B_m_s2.t_s.front() = -wild;
    const CheckedFlight c = check_flight(f.record, f.vehicle);
    ASSERT_FALSE(c.refusal) << findings_table(c);
    const LogFinding* after = find(c, "gyro", FindingAction::exclude, "after all others");
    const LogFinding* before = find(c, "accelerometer", FindingAction::exclude, "before all others");
    ASSERT_TRUE(after && before) << findings_table(c);
    EXPECT_NEAR(after->from_s, 116.0, 0.01) << "where in the flight it stands";
    EXPECT_NEAR(before->to_s, 100.0, 0.01);
    EXPECT_EQ(c.flight.gyro_B_rad_s.size(), f.record.gyro_B_rad_s.size() - 1);
    ASSERT_EQ(c.segments.size(), 1u);
    EXPECT_NEAR(c.segments[0].span_s(), 16.0, 0.02);
  }
}

TEST(Stamps, OneWildStampAmongOthersIsToldWhereItStandsAndInFewDigits) {
  AnalyticFlight f = analytic_flight();
  f.record.gyro_B_rad_s.t_s[4000] = 1e300;
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  const LogFinding* wild = find(c, "gyro", FindingAction::exclude, "1 samples out of order");
  ASSERT_NE(wild, nullptr) << findings_table(c);
  EXPECT_NEAR(wild->from_s, 108.0, 0.01);
  EXPECT_LT(wild->what.size(), 80u);
}

TEST(Stamps, InAnotherUnitAreRefusedWithTheUnitAndTheKeyToSet) {
  for (const auto& [factor, unit] : {std::pair{1e3, "us where the mapping says ms, or ms where it says s (then 10 ms)"},
                                     {1e6, "us where the mapping says s"},
                                     {1e-3, "s where the mapping says ms"}}) {
    AnalyticFlight f = analytic_flight();
    scale_stamps(f.record, factor);
    const CheckedFlight c = check_flight(f.record, f.vehicle);
    ASSERT_TRUE(c.refusal) << findings_table(c);
    EXPECT_THAT(c.refusal->likely, HasSubstr(unit));
    EXPECT_THAT(c.refusal->remedy, HasSubstr("[time] unit"));
  }
}

TEST(Stamps, OfTwoClocksAreRefusedWithTheSpanOfEachStream) {
  AnalyticFlight f = analytic_flight();
  for (double& t : f.record.pose.t_s) t += 1.7e9;
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->what, HasSubstr("gyro 100 to 116 s"));
  EXPECT_THAT(c.refusal->likely, HasSubstr("two clocks"));
}

TEST(Stamps, ThatFallFromRowToRowAreRefusedAsRowsInReverse) {
  AnalyticFlight f = analytic_flight();
  auto& g = f.record.gyro_B_rad_s;
  std::reverse(g.t_s.begin(), g.t_s.end());
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->likely, HasSubstr("reverse order"));
}

TEST(Stamps, OfAClockThatWasSetBackSplitTheFlightThereAndKeepBothSides) {
  AnalyticFlight f = analytic_flight();
  FlightRecord& r = f.record;
  for (auto* t : {&r.pose.t_s, &r.velocity_W_m_s.t_s, &r.gyro_B_rad_s.t_s, &r.accel_B_m_s2.t_s, &r.rotor_omega_rad_s.t_s, &r.battery_V.t_s})
    for (double& x : *t) x -= x > 108.0 ? 0.5 : 0.0;
  const CheckedFlight c = check_flight(r, f.vehicle);
  ASSERT_FALSE(c.refusal) << findings_table(c);
  ASSERT_EQ(c.segments.size(), 2u) << findings_table(c);
  EXPECT_NEAR(c.segments[0].to_s, 107.5, 0.02);
  EXPECT_NEAR(c.segments[1].from_s, 108.0, 0.02);
  EXPECT_NEAR(c.segments[1].to_s, 115.5, 0.02);
}

TEST(Grid, OfMoreThanALongFlightIsAnErrorNotAnAllocation) {
  EXPECT_THROW(grid_over({0.0, 1e9}, 0.0025), Error);
  EXPECT_THROW(grid_over({0.0, 1e300}, 0.0025), Error);
  EXPECT_EQ(grid_over({0.0, 1.0}, 0.25).count, 5u);
}

}  // namespace
}  // namespace rotorloop::log
