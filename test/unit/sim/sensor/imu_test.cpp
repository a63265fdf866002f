// The inertial sensor against the figures of its file: bias, noise, vibration; and its independence of everything else.
#include "sim/sensor/imu.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "test/unit/sim/sensor/statistics.hpp"

namespace rotorloop::sim {
namespace {

using Four = std::array<double, 4>;
constexpr Four kStopped{0, 0, 0, 0};

AirframeConfig body() {
  AirframeConfig c;
  c.mass_kg = 0.682;
  c.inertia_kg_m2 = Eigen::Vector3d(2.41e-3, 3.42e-3, 5.22e-3).asDiagonal();
  const double l = 0.0885, z = 0.02;
  const Eigen::Vector3d hubs[] = {{l, -l, z}, {-l, l, z}, {l, l, z}, {-l, -l, z}};
  for (std::size_t i = 0; i < 4; ++i) c.rotors[i] = {hubs[i], i < 2 ? 1 : -1, Eigen::Vector2d::Zero(), 9.4e-6};
  return c;
}
ImuConfig silent() { return {.gyro_noise_rad_s = 0, .accel_noise_m_s2 = 0, .gyro_bias_rad_s = 0, .accel_bias_m_s2 = 0, .vibration = 0}; }
AirframeState moving() {
  AirframeState s;
  s.time_ns = 123'000'000;
  s.w_B_rad_s = {0.1, -0.2, 0.3};
  s.specific_force_B_m_s2 = {0.5, -0.6, 9.7};
  return s;
}

TEST(ImuSensor, WithoutErrorsReportsRateAndSpecificForceAtTheInstantOfTheState) {
  ImuSensor imu(silent(), body(), 1);
  const ImuReading r = imu.sample(0, moving(), Four{900, 900, 900, 900});
  EXPECT_EQ(r.gyro_B_rad_s, moving().w_B_rad_s);
  EXPECT_EQ(r.accel_B_m_s2, moving().specific_force_B_m_s2);
  EXPECT_EQ(r.time_ns, 123'000'000);
  EXPECT_EQ(imu.time_of_sample_ns(1234), 1'234'000'000);
}

TEST(ImuSensor, WhiteNoiseHasTheFilesDeviationOnEveryAxisAndNoMemory) {
  ImuConfig c = silent();
  c.gyro_noise_rad_s = 0.01;
  c.accel_noise_m_s2 = 0.15;
  ImuSensor imu(c, body(), 7);
  std::vector<double> series[6];
  for (std::int64_t n = 0; n < 20000; ++n) {
    const ImuReading r = imu.sample(n, AirframeState{}, kStopped);
    for (int k = 0; k < 3; ++k) {
      series[k].push_back(r.gyro_B_rad_s[k]);
      series[3 + k].push_back(r.accel_B_m_s2[k] - (k == 2 ? kGravity_m_s2 : 0.0));
    }
  }
  for (int k = 0; k < 6; ++k) {
    const double sigma = k < 3 ? 0.01 : 0.15;
    EXPECT_NEAR(test::deviation(series[k]), sigma, 0.02 * sigma) << k;  // 4 sigma of the estimate
    EXPECT_NEAR(test::mean(series[k]), 0.0, 4.0 * sigma / std::sqrt(20000.0)) << k;
    EXPECT_LT(std::fabs(test::correlation(series[k], 1)), 0.03) << k;
  }
  double cross = 0.0;
  for (std::size_t i = 0; i < 20000; ++i) cross += series[0][i] * series[1][i];
  EXPECT_LT(std::fabs(cross / 20000.0 / 1e-4), 0.03) << "axes are independent";
}

TEST(ImuSensor, TurnOnBiasIsConstantInARunAndHasTheFilesDeviationOverSeeds) {
  ImuConfig c = silent();
  c.gyro_bias_rad_s = 0.005;
  c.accel_bias_m_s2 = 0.05;
  std::vector<double> gyro, accel;
  for (std::uint64_t seed = 0; seed < 4000; ++seed) {
    ImuSensor imu(c, body(), seed);
    const ImuReading first = imu.sample(0, moving(), kStopped);
    const Eigen::Vector3d bias = first.gyro_B_rad_s - moving().w_B_rad_s;
    EXPECT_LT((bias - imu.gyro_bias_B_rad_s()).norm(), 1e-15);
    EXPECT_EQ(imu.sample(1, moving(), kStopped).gyro_B_rad_s, first.gyro_B_rad_s);
    for (int k = 0; k < 3; ++k) {
      gyro.push_back(bias[k]);
      accel.push_back(imu.accel_bias_B_m_s2()[k]);
    }
  }
  EXPECT_NEAR(test::deviation(gyro), 0.005, 0.0001);  // 3 sigma of the estimate
  EXPECT_NEAR(test::deviation(accel), 0.05, 0.001);
  EXPECT_NEAR(test::mean(gyro), 0.0, 0.00015);
}

// Amplitude of a series at one frequency, by projection over whole turns.
double amplitude(const std::vector<double>& x, double omega_rad_s) {
  double c = 0.0, s = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double phase = omega_rad_s * static_cast<double>(i) * 1e-3;
    c += x[i] * std::cos(phase);
    s += x[i] * std::sin(phase);
  }
  return 2.0 * std::hypot(c, s) / static_cast<double>(x.size());
}
struct Shaking {
  std::vector<double> accel_x, accel_z, gyro_z;
};
Shaking shake(const Four& omega_rad_s, double vibration, std::uint64_t seed = 3) {
  ImuConfig c = silent();
  c.vibration = vibration;
  ImuSensor imu(c, body(), seed);
  Shaking out;
  for (std::int64_t n = 0; n < 1000; ++n) {
    const ImuReading r = imu.sample(n, AirframeState{}, omega_rad_s);
    out.accel_x.push_back(r.accel_B_m_s2.x());
    out.accel_z.push_back(r.accel_B_m_s2.z() - kGravity_m_s2);
    out.gyro_z.push_back(r.gyro_B_rad_s.z());
  }
  return out;
}
constexpr double kHz = 2.0 * std::numbers::pi;

TEST(ImuVibration, StandsAtRotorFrequencyWithUOmegaSquaredOverMass) {
  const double omega = 150.0 * kHz;  // 9000 turns a minute: hover
  const Shaking s = shake({omega, 0, 0, 0}, 1.0);
  const double expected = kUnbalance_kg_m * omega * omega / 0.682;
  EXPECT_NEAR(amplitude(s.accel_x, omega), expected, 1e-3 * expected);
  EXPECT_NEAR(amplitude(s.accel_z, omega), kTrackRatio * expected, 1e-3 * expected);
  EXPECT_LT(amplitude(s.accel_x, 140.0 * kHz), 1e-3 * expected) << "and nowhere else";
  EXPECT_GT(expected, 0.3);
  EXPECT_LT(expected, 3.0) << "a healthy airframe";
}
TEST(ImuVibration, YawRateHasTheSizeOfTheForceAtTheHubsArm) {
  const double omega = 150.0 * kHz;
  // Moment about z of a force turning at (0.0885, -0.0885): arm 0.1252 m whatever the angle.
  const double expected = kUnbalance_kg_m * omega * omega * 0.0885 * std::numbers::sqrt2 / 5.22e-3 / omega;
  EXPECT_NEAR(amplitude(shake({omega, 0, 0, 0}, 1.0).gyro_z, omega), expected, 1e-3 * expected);
}
TEST(ImuVibration, ForceTurnsWithTheRotorAndTheRateIsTheIntegralOfItsMoment) {
  // Slow enough to differentiate the samples: 5 turns a second.
  const double omega = 5.0 * kHz;
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    ImuConfig c = silent();
    c.vibration = 1000.0;
    ImuSensor imu(c, body(), 3);
    Four speeds = kStopped;
    speeds[rotor] = omega;
    std::vector<ImuReading> r;
    for (std::int64_t n = 0; n < 400; ++n) {
      r.push_back(imu.sample(n, AirframeState{}, speeds));
      r.back().accel_B_m_s2.z() -= kGravity_m_s2;
    }
    const RotorMount mount = body().rotors[rotor];
    for (std::size_t n = 1; n + 1 < r.size(); ++n) {
      const Eigen::Vector3d& a = r[n].accel_B_m_s2;
      const Eigen::Vector3d a_dot = (r[n + 1].accel_B_m_s2 - r[n - 1].accel_B_m_s2) / 2e-3;
      const double turning_rad_s = (a.x() * a_dot.y() - a.y() * a_dot.x()) / (a.x() * a.x() + a.y() * a.y());
      EXPECT_NEAR(turning_rad_s, mount.spin * omega, 0.01 * omega) << "rotor " << rotor + 1;
      const Eigen::Vector3d w_dot = (r[n + 1].gyro_B_rad_s - r[n - 1].gyro_B_rad_s) / 2e-3;
      const Eigen::Vector3d expected = body().inertia_kg_m2.inverse() * mount.hub_m.cross(0.682 * a);
      EXPECT_LT((w_dot - expected).norm(), 0.01 * expected.norm() + 1e-3) << "rotor " << rotor + 1;
    }
  }
}
TEST(ImuVibration, AccelerationGrowsWithOmegaSquaredAndRateWithOmega) {
  const double slow = 100.0 * kHz, fast = 200.0 * kHz;
  const Shaking a = shake({slow, 0, 0, 0}, 1.0), b = shake({fast, 0, 0, 0}, 1.0);
  EXPECT_NEAR(amplitude(b.accel_x, fast) / amplitude(a.accel_x, slow), 4.0, 1e-6);
  EXPECT_NEAR(amplitude(b.gyro_z, fast) / amplitude(a.gyro_z, slow), 2.0, 1e-6);
}
TEST(ImuVibration, ScalesWithTheFilesFactorAndVanishesWithItAndWithStoppedRotors) {
  const double omega = 150.0 * kHz;
  EXPECT_NEAR(amplitude(shake({omega, 0, 0, 0}, 3.0).accel_x, omega) / amplitude(shake({omega, 0, 0, 0}, 1.0).accel_x, omega), 3.0, 1e-9);
  EXPECT_EQ(test::rms(shake({omega, omega, omega, omega}, 0.0).accel_x), 0.0);
  EXPECT_EQ(test::rms(shake(kStopped, 1.0).accel_x), 0.0);
}
TEST(ImuVibration, PhasesOfTheRotorsComeFromTheSeed) {
  const double omega = 150.0 * kHz;
  const Four all{omega, omega, omega, omega};
  EXPECT_EQ(shake(all, 1.0, 3).accel_x, shake(all, 1.0, 3).accel_x);
  EXPECT_GT(std::fabs(test::rms(shake(all, 1.0, 3).accel_x) - test::rms(shake(all, 1.0, 4).accel_x)), 1e-3)
      << "equal speeds add up by phase";
}
TEST(ImuVibration, FollowsARotorThatChangesItsSpeedWithoutAJumpOfPhase) {
  ImuConfig c = silent();
  c.vibration = 1.0;
  ImuSensor imu(c, body(), 3);
  double largest_jump = 0.0, previous = 0.0;
  for (std::int64_t n = 0; n < 4000; ++n) {
    const double omega = 60.0 + 0.01 * static_cast<double>(n);  // slow enough to see the wave: 10 Hz
    const double now = imu.sample(n, AirframeState{}, Four{omega, 0, 0, 0}).accel_B_m_s2.x() / (omega * omega * kUnbalance_kg_m / 0.682);
    if (n > 0) largest_jump = std::max(largest_jump, std::fabs(now - previous));
    previous = now;
  }
  EXPECT_LT(largest_jump, 0.11);  // omega T = 0.1 rad at most
}

TEST(ImuSensor, SwitchingOneErrorOffShiftsNoNumberOfAnother) {
  ImuConfig all, quiet_gyro;
  quiet_gyro.gyro_noise_rad_s = 0.0;
  quiet_gyro.gyro_bias_rad_s = 0.0;
  ImuSensor a(all, body(), 5), b(quiet_gyro, body(), 5);
  for (std::int64_t n = 0; n < 50; ++n)
    EXPECT_EQ(a.sample(n, moving(), Four{900, 910, 920, 930}).accel_B_m_s2, b.sample(n, moving(), Four{900, 910, 920, 930}).accel_B_m_s2);
}

TEST(ImuSensor, RectifiedVibrationIsABiasOfAbout0Point1MetrePerSecondSquaredInHoverAndFourfoldAtTwiceTheSpeed) {
  ImuConfig c = silent();
  c.rectification_m = 1.1e-7;
  ImuSensor imu(c, body(), 1);
  const double hover = imu.sample(0, moving(), Four{945, 945, 945, 945}).accel_B_m_s2.z() - moving().specific_force_B_m_s2.z();
  const double twice = imu.sample(1, moving(), Four{1890, 1890, 1890, 1890}).accel_B_m_s2.z() - moving().specific_force_B_m_s2.z();
  EXPECT_NEAR(hover, 0.098, 0.001);
  EXPECT_NEAR(twice / hover, 4.0, 1e-9);
}

}  // namespace
}  // namespace rotorloop::sim
