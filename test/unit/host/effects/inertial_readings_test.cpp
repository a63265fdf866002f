// What terms make the inertial sensors and the clock of the pose read.
#include <gtest/gtest.h>

#include <cmath>

#include "host/base/constants.hpp"
#include "test/unit/host/effects/flown.hpp"

namespace rotorloop::host {
namespace {

TEST(Readings, AnImuPitchedBy3DegreesFeelsGravityAlongItsXAxisAndRollAboutItsYaw) {
  LoadInput<double> in = hover(paper_vehicle());
  in.rates_B_rad_s = {2.0, 0.0, 0.0};
  ReadingState<double> r{in, {}, {}, {}};
  r.specific_force_B_m_s2 = {0.0, 0.0, 9.81};
  const double angle = 3.0 / kDeg_per_rad, values[] = {0.0, angle, 0.0};
  const TermList list = only("imu_rotation");
  readings(r, TermSet<double>(list, values));
  EXPECT_NEAR(r.accel_B_m_s2.x, -9.81 * std::sin(angle), 3e-4);
  EXPECT_NEAR(r.accel_B_m_s2.z, 9.81 * (std::cos(angle) - 1.0), 3e-4);
  EXPECT_NEAR(r.gyro_B_rad_s.z, 2.0 * std::sin(angle), 1e-4);
}

TEST(Readings, ScaledGyroAndAccelerometerReadEachAxisByItsOwnShareTooMuch) {
  LoadInput<double> in = hover(paper_vehicle());
  in.rates_B_rad_s = {1.0, -2.0, 3.0};
  ReadingState<double> gyro{in, {}, {}, {}}, accel{in, {}, {}, {}};
  gyro.specific_force_B_m_s2 = accel.specific_force_B_m_s2 = {0.5, -1.0, 9.0};
  const double values[] = {0.01, 0.02, 0.03};
  const TermList of_gyro = only("gyro_scale"), of_accel = only("accel_scale");
  readings(gyro, TermSet<double>(of_gyro, values));
  readings(accel, TermSet<double>(of_accel, values));
  EXPECT_NEAR(gyro.gyro_B_rad_s.x, 0.01, 1e-15);
  EXPECT_NEAR(gyro.gyro_B_rad_s.y, -0.04, 1e-15);
  EXPECT_NEAR(gyro.gyro_B_rad_s.z, 0.09, 1e-15);
  EXPECT_EQ(gyro.accel_B_m_s2.z, 0.0);
  EXPECT_NEAR(accel.accel_B_m_s2.y, -0.02, 1e-15);
  EXPECT_NEAR(accel.accel_B_m_s2.z, 0.27, 1e-15);
  EXPECT_EQ(accel.gyro_B_rad_s.z, 0.0);
}

TEST(Readings, AClockThatRunsFastBy1eMinus3Is20MillisecondsLateAfter20Seconds) {
  LoadInput<double> in = general_flight();
  in.rates_B_rad_s = {1.0, 2.0, 3.0};
  ReadingState<double> r{in, {1.0, -2.0, 3.0}, {4.0, 5.0, -6.0}, {}};
  r.since_start_s = 20.0;
  const double rate = 1e-3;
  const TermList list = only("clock_rate");
  readings(r, TermSet<double>(list, &rate));
  EXPECT_NEAR(r.position_W_m.x, -0.08, 1e-15);
  EXPECT_NEAR(r.position_W_m.z, 0.12, 1e-15);
  EXPECT_NEAR(r.turn_B_rad.z, -0.06, 1e-15);
  EXPECT_EQ(r.gyro_B_rad_s.x + r.accel_B_m_s2.z, 0.0);
}

}  // namespace
}  // namespace rotorloop::host
