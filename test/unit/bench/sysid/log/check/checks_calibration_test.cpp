// Scales and turn of the IMU, put into a clean flight: each is told to a fraction of what a data sheet promises, and a sound IMU gets no
// note.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "host/base/constants.hpp"
#include "test/unit/bench/sysid/log/check/checked_flights.hpp"

namespace rotorloop::log {
namespace {

using estimate::testing::analytic_flight;
using estimate::testing::AnalyticFlight;
using testing::change;
using testing::find;
using testing::kAlways_s;

const AnalyticFlight& sound() {
  static const AnalyticFlight flight = analytic_flight(1);
  return flight;
}
CheckedFlight checked(const AnalyticFlight& f) { return check_flight(f.record, f.vehicle); }

// The number in front of `unit` nearest behind `words`, one of three: "2.98, 0.01, -0.02 %".
double number(const std::string& text, const std::string& words, int which) {
  std::size_t at = text.find(words) + words.size();
  for (int i = 0; i < which; ++i) at = text.find(',', at) + 1;
  return std::stod(text.substr(at));
}

TEST(Calibration, ASoundImuGetsNoNote) {
  const CheckedFlight c = checked(sound());
  EXPECT_EQ(find(c, "gyro", FindingAction::note, "reads"), nullptr) << findings_table(c);
  EXPECT_EQ(find(c, "gyro", FindingAction::note, "turned"), nullptr) << findings_table(c);
  EXPECT_EQ(find(c, "accelerometer", FindingAction::note, "changes by"), nullptr) << findings_table(c);
}

TEST(Calibration, AGyroThatReads3PercentMoreAboutYIsToldByAxisWithin3p3UncertaintiesOfAFifthOfAPercent) {
  AnalyticFlight f = sound();
  change(f.record.gyro_B_rad_s, -kAlways_s, kAlways_s, [](Eigen::Vector3d& w) { w.y() *= 1.03; });
  const CheckedFlight c = checked(f);
  const LogFinding* note = find(c, "gyro", FindingAction::note, "reads ");
  ASSERT_NE(note, nullptr) << findings_table(c);
  const double truth[] = {0.0, 3.0, 0.0};
  for (int axis = 0; axis < 3; ++axis) {
    const double u = number(note->what, "(u ", axis);
    EXPECT_LT(u, 0.2) << note->what;
    EXPECT_NEAR(number(note->what, "reads ", axis), truth[axis], 3.3 * u) << note->what;
  }
}

TEST(Calibration, AnImuTurnedBy2DegreesAboutXIsToldToAFifthOfADegree) {
  AnalyticFlight f = sound();
  const Eigen::Matrix3d to_imu = Eigen::AngleAxisd(2.0 / kDeg_per_rad, Eigen::Vector3d::UnitX()).toRotationMatrix().transpose();
  change(f.record.gyro_B_rad_s, -kAlways_s, kAlways_s, [&](Eigen::Vector3d& w) { w = to_imu * w; });
  change(f.record.accel_B_m_s2, -kAlways_s, kAlways_s, [&](Eigen::Vector3d& a) { a = to_imu * a; });
  const CheckedFlight c = checked(f);
  const LogFinding* note = find(c, "gyro", FindingAction::note, "turned by ");
  ASSERT_NE(note, nullptr) << findings_table(c);
  EXPECT_NEAR(number(note->what, "turned by ", 0), 2.0, 0.2) << note->what;
  EXPECT_NEAR(number(note->what, "turned by ", 1), 0.0, 0.2) << note->what;
  EXPECT_EQ(find(c, "gyro", FindingAction::note, "reads "), nullptr) << findings_table(c);
}

TEST(Calibration, AnAccelerometerThatReads3PercentMoreIsToldToHalfAPercentAlongTheThrust) {
  AnalyticFlight f = sound();
  change(f.record.accel_B_m_s2, -kAlways_s, kAlways_s, [](Eigen::Vector3d& a) { a *= 1.03; });
  const CheckedFlight c = checked(f);
  const LogFinding* note = find(c, "accelerometer", FindingAction::note, "changes by ");
  ASSERT_NE(note, nullptr) << findings_table(c);
  EXPECT_NEAR(number(note->what, "changes by ", 0), 3.0, 0.5) << note->what;
}

TEST(Calibration, ASoundAccelerometerIsNotBlamedForPositionsOf1CentimetreNoise) {
  AnalyticFlight f = sound();
  std::mt19937_64 random(1);
  std::normal_distribution<> noise_m(0.0, 0.01);
  change(f.record.pose, -kAlways_s, kAlways_s,
         [&](PoseReading& p) { p.p_W_m += Eigen::Vector3d(noise_m(random), noise_m(random), noise_m(random)); });
  const CheckedFlight c = checked(f);
  EXPECT_EQ(find(c, "accelerometer", FindingAction::note, "changes by"), nullptr) << findings_table(c);
}

}  // namespace
}  // namespace rotorloop::log
