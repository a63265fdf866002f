// Stamps that are no clock of a flight: wild ones, a wrong unit, a clock that was set back. Told before any grid is laid over them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "bench/sysid/log/read_flight.hpp"
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

TEST(InputRate, SpeedsHeldAt4HzInAFastTableAreRefusedAsSlowAndThoseAt25HzAreNot) {
  for (const auto& [rate_Hz, refused] : {std::pair{4.0, true}, {10.0, true}, {25.0, false}}) {
    AnalyticFlight f = analytic_flight();
    auto& w = f.record.rotor_omega_rad_s;
    double since = -1.0;
    RotorValues held{};
    for (std::size_t i = 0; i < w.size(); ++i) {
      if (const double n = std::floor(w.t_s[i] * rate_Hz + 1e-6); n != since) {
        since = n;
        held = w.value[i];
      }
      w.value[i] = held;
    }
    const CheckedFlight c = check_flight(f.record, f.vehicle);
    ASSERT_EQ(c.refusal && c.refusal->what.find("too slow for what a fit needs") != std::string::npos, refused)
        << rate_Hz << findings_table(c);
    if (refused) {
      EXPECT_THAT(c.refusal->what, HasSubstr("stand in the log at")) << "and not a slow table";
    }
  }
}

// PX4's default profile has ESC reports every quarter of a second.
TEST(InputRate, SpeedsOfATableAt4HzAreRefusedAsSlowAndNotAsMisreadStamps) {
  AnalyticFlight f = analytic_flight();
  const auto fast = std::exchange(f.record.rotor_omega_rad_s, {});
  for (std::size_t i = 0; i < fast.size(); ++i)
    if (auto& slow = f.record.rotor_omega_rad_s; slow.empty() || fast.t_s[i] > slow.t_s.back() + 0.2499)
      slow.add(fast.t_s[i], fast.value[i]);
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->what, HasSubstr("every 0.25 s (allowed 0.05 s): too slow"));
  EXPECT_THAT(c.refusal->likely, HasSubstr("slow motor outputs or ESC reports"));
}

TEST(InputRate, CommandsAt10HzAreRefusedWithWhatToLogWhereNoSpeedsAreThere) {
  AnalyticFlight f = analytic_flight();
  for (double t = f.record.gyro_B_rad_s.t_s.front(); t < f.record.gyro_B_rad_s.t_s.back(); t += 0.1)
    f.record.motor_command.add(t, {0.5 + 0.01 * std::sin(t), 0.5, 0.5, 0.5});
  f.record.rotor_omega_rad_s = {};
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->what, HasSubstr("motor command"));
  EXPECT_THAT(c.refusal->what, HasSubstr("come 10 times a second, every 0.1 s (allowed 0.05 s)"));
  EXPECT_THAT(c.refusal->remedy, HasSubstr("at 100 Hz or more"));
}

TEST(InputRate, MotorsThatAreOffThroughoutAreNoFlight) {
  AnalyticFlight f = analytic_flight();
  for (RotorValues& w : f.record.rotor_omega_rad_s.value) w = {0.0, 0.0, 3.0, 0.0};
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->what, HasSubstr("motors are off throughout"));
}

class FieldLogs : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("ROTORLOOP_DATA") == nullptr) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  }
  static CheckedFlight check(const char* log, const char* mapping) {
    const auto root = std::filesystem::path(std::getenv("ROTORLOOP_DATA")) / "field";
    const LogMapping m = read_log_mapping(root / mapping);
    return check_flight(read_flight(root / log, &m, nullptr));
  }
};

TEST_F(FieldLogs, CommandsAt10HzAndMotorsThatAreOffAreRefusedAndAWrappedClockIsNot) {
  const CheckedFlight slow = check("L4_cmd10Hz.csv", "L.mapping.toml");
  ASSERT_TRUE(slow.refusal);
  EXPECT_THAT(slow.refusal->what, HasSubstr("come 10 times a second"));
  const CheckedFlight off = check("L5_off.csv", "L.mapping.toml");
  ASSERT_TRUE(off.refusal);
  EXPECT_THAT(off.refusal->what, HasSubstr("motors are off throughout"));
  const CheckedFlight wrapped = check("L6_wrap.csv", "L6.mapping.toml");
  EXPECT_FALSE(wrapped.refusal) << findings_table(wrapped);
  EXPECT_NEAR(wrapped.flight.gyro_B_rad_s.t_s.back() - wrapped.flight.gyro_B_rad_s.t_s.front(), 20.0, 1.0);
}

}  // namespace
}  // namespace rotorloop::log
