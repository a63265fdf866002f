// What a flight can determine, and logs judged without a vehicle file.
#include "bench/sysid/log/check/log_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "bench/sysid/log/check/checks.hpp"
#include "host/base/constants.hpp"
#include "test/unit/bench/sysid/log/check/checked_flights.hpp"

namespace rotorloop::log {
namespace {

using estimate::testing::analytic_flight;
using estimate::testing::AnalyticFlight;
using testing::change;
using ::testing::HasSubstr;
using testing::kAlways_s;
using ::testing::Not;

Outlook outlook_of(const FlightRecord& f, const std::string& parameter) {
  for (const ParameterOutlook& p : parameter_outlook(f, flight_content(f)))
    if (p.parameter == parameter) return p.outlook;
  ADD_FAILURE() << "no parameter " << parameter;
  return Outlook::none;
}

// Stays where it is, level, for as long as `f`.
FlightRecord at_rest(FlightRecord f) {
  for (Eigen::Vector3d& v : f.gyro_B_rad_s.value) v.setZero();
  for (Eigen::Vector3d& v : f.accel_B_m_s2.value) v = kGravity_m_s2 * Eigen::Vector3d::UnitZ();
  for (Eigen::Vector3d& v : f.velocity_W_m_s.value) v.setZero();
  for (PoseReading& p : f.pose.value) p = {};
  return f;
}

TEST(FlightContent, OfTheBuiltFlightIsItsSpeedClimbAndDuration) {
  const FlightContent c = flight_content(analytic_flight().record);
  EXPECT_NEAR(c.seconds, 16.0, 0.01);
  EXPECT_NEAR(*c.speed_rms_m_s, std::sqrt(0.5 * (1.44 * 1.44 + 1.26 * 1.26)), 0.1);     // 0.9 m at 1.6 rad/s, 0.6 m at 2.1 rad/s
  EXPECT_NEAR(*c.climb_rms_m_s, std::sqrt(0.5 * (0.775 * 0.775 + 0.45 * 0.45)), 0.05);  // 0.25 m at 3.1 rad/s, 0.05 m at 9 rad/s
}

TEST(FlightContent, OfAWobbleAt5HzIsItsRmsRateAndOfOneAtHalfAHertzNothing) {
  for (const auto& [hertz, rms] : {std::pair{5.0, 0.4 / std::sqrt(2.0)}, std::pair{0.5, 0.0}}) {
    FlightRecord f = at_rest(analytic_flight().record);
    auto& g = f.gyro_B_rad_s;
    for (std::size_t i = 0; i < g.size(); ++i) g.value[i].x() = 0.4 * std::sin(2.0 * std::numbers::pi * hertz * g.t_s[i]);
    EXPECT_NEAR((*flight_content(f).turning_rad_s)[0], rms, 0.02) << hertz;
  }
}

TEST(ParameterOutlook, ClimbTellsK2SpeedTellsDragAndTurningTellsInertia) {
  const FlightRecord flown = analytic_flight().record, still = at_rest(flown);
  EXPECT_EQ(outlook_of(flown, "k_2"), Outlook::enough);
  EXPECT_EQ(outlook_of(flown, "c_dh, c_dxy"), Outlook::enough);
  EXPECT_EQ(outlook_of(still, "k_1"), Outlook::enough);
  EXPECT_EQ(outlook_of(still, "k_2"), Outlook::none);
  EXPECT_EQ(outlook_of(still, "c_dh, c_dxy"), Outlook::none);
  EXPECT_EQ(outlook_of(still, "I_xx, centre of mass y"), Outlook::none);
  FlightRecord wobbling = still;
  auto& g = wobbling.gyro_B_rad_s;
  for (std::size_t i = 0; i < g.size(); ++i) g.value[i].x() = 0.4 * std::sin(30.0 * g.t_s[i]);
  EXPECT_EQ(outlook_of(wobbling, "I_xx, centre of mass y"), Outlook::enough);
  EXPECT_EQ(outlook_of(wobbling, "I_yy, centre of mass x"), Outlook::none);
}

TEST(ParameterOutlook, NothingIsToldWithoutRotorSpeedsAndCommands) {
  FlightRecord f = analytic_flight().record;
  f.rotor_omega_rad_s = {};
  const auto outlook = parameter_outlook(f, flight_content(f));
  ASSERT_FALSE(outlook.empty());
  for (const ParameterOutlook& p : outlook) {
    EXPECT_EQ(p.outlook, Outlook::none) << p.parameter;
    EXPECT_THAT(p.because, HasSubstr("no rotor speeds"));
  }
}

TEST(LogReport, WithoutAVehicleFileNamesExchangedColumnsAndSaysWhatWasNotChecked) {
  AnalyticFlight f = analytic_flight();
  const LogReport sound = report_log(f.record, {}, nullptr);
  EXPECT_FALSE(sound.checked.refusal) << findings_table(sound.checked);
  EXPECT_THAT(log_report_text({sound}, false), HasSubstr("not checked without a vehicle file"));
  EXPECT_THAT(log_report_text({sound}, true), Not(HasSubstr("not checked")));
  change(f.record.rotor_omega_rad_s, 0.0, kAlways_s, [](RotorValues& w) { std::swap(w[0], w[2]); });
  const LogReport exchanged = report_log(f.record, {}, nullptr);
  ASSERT_TRUE(exchanged.checked.refusal);
  EXPECT_THAT(exchanged.checked.refusal->likely, HasSubstr("rotor 1 and rotor 3 are exchanged"));
}

TEST(LogReport, JsonHasTheTextsFindingsContentAndParametersAndOfSeveralFlightsTheBest) {
  const AnalyticFlight f = analytic_flight();
  const FlightRecord still = at_rest(f.record);
  LogReport one = report_log(f.record, {}, &f.vehicle), two;
  two.record = still;
  two.content = flight_content(still);
  two.parameters = parameter_outlook(still, two.content);
  const auto j = nlohmann::json::parse(log_report_json({two, one}, true));
  ASSERT_EQ(j.at("flights").size(), 2u);
  EXPECT_EQ(j.at("flights")[1].at("findings").size(), one.checked.findings.size());
  EXPECT_NEAR(j.at("flights")[1].at("content").at("seconds").get<double>(), 16.0, 0.05);
  ASSERT_EQ(j.at("parameters")[1].at("parameter"), "k_2");
  EXPECT_EQ(j.at("parameters")[1].at("outlook"), "enough") << "the flight that climbs counts";
}

}  // namespace
}  // namespace rotorloop::log
