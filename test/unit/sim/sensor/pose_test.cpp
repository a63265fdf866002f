// The pose sensor against its figures: which point it measures, noise, drift, delay, order.
#include "sim/sensor/pose.hpp"

#include <gtest/gtest.h>

#include "host/base/error.hpp"
#include "test/unit/sim/sensor/statistics.hpp"

namespace rotorloop::sim {
namespace {

PoseConfig silent_pose() {
  PoseConfig c;
  c.noise_m = c.noise_rad = c.velocity_noise_m_s = c.drift_m = 0.0;
  return c;
}
AirframeState at(std::int64_t time_ns) {
  AirframeState s;
  s.time_ns = time_ns;
  return s;
}

TEST(PoseSensor, MeasuresItsOwnPointAndNotTheCentreOfMass) {
  PoseConfig c = silent_pose();
  c.q_BS = Eigen::Quaterniond(std::sqrt(0.5), 0, 0, std::sqrt(0.5));
  PoseSensor pose(c, 1);
  AirframeState s = at(5'000'000);
  s.p_W_m = {1.0, 2.0, 3.0};
  s.v_W_m_s = {0.5, 0.0, 0.0};
  s.w_B_rad_s = {0.0, 0.0, 2.0};
  s.q_WB = Eigen::Quaterniond(std::sqrt(0.5), 0, 0, std::sqrt(0.5));  // nose along world y: body x -> y, body y -> -x
  const PoseReading r = pose.sample(0, s).reading;
  EXPECT_LT((r.p_W_m - Eigen::Vector3d(1.0 - 0.006, 2.0 + 0.090, 3.0 + 0.014)).norm(), 1e-12);
  // w x r in B = 2 * (-0.006, 0.090, 0); in W (-0.180, -0.012, 0).
  EXPECT_LT((r.v_W_m_s - Eigen::Vector3d(0.5 - 0.180, -0.012, 0.0)).norm(), 1e-12);
  EXPECT_LT(r.q_WS.angularDistance(Eigen::Quaterniond(0, 0, 0, 1)), 1e-7);
  EXPECT_EQ(r.time_ns, 5'000'000) << "stamped at the measurement";
  EXPECT_EQ(pose.time_of_sample_ns(3), 15'000'000);
}

TEST(PoseSensor, WhiteNoiseIs2MillimetresAnd2MilliradiansAnd5CentimetresPerSecondOnEveryAxis) {
  PoseConfig c;
  c.drift_enabled = false;
  c.offset_B_m.setZero();
  PoseSensor pose(c, 11);
  AirframeState s;
  s.q_WB = Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5);
  std::vector<double> series[9];
  for (std::int64_t n = 0; n < 20000; ++n) {
    const PoseReading r = pose.sample(n, s).reading;
    const Eigen::Quaterniond error = s.q_WB.conjugate() * r.q_WS;
    EXPECT_NEAR(r.q_WS.norm(), 1.0, 1e-15);
    for (int k = 0; k < 3; ++k) {
      series[k].push_back(r.p_W_m[k]);
      series[3 + k].push_back(2.0 * error.vec()[k]);
      series[6 + k].push_back(r.v_W_m_s[k]);
    }
  }
  for (int k = 0; k < 9; ++k) {
    const double sigma = k < 3 ? 0.002 : k < 6 ? 0.002 : 0.05;
    EXPECT_NEAR(test::deviation(series[k]), sigma, 0.02 * sigma) << k;
    EXPECT_LT(std::fabs(test::mean(series[k])), 4.0 * sigma / std::sqrt(20000.0)) << k;
    EXPECT_LT(std::fabs(test::correlation(series[k], 1)), 0.03) << k;
  }
}

TEST(PoseDrift, Is5MillimetresRmsWith15SecondsOfCorrelation) {
  PoseConfig c = silent_pose();
  c.drift_m = 0.005;
  c.rate_Hz = 1;  // the discretisation is exact at any rate; long and cheap
  PoseSensor pose(c, 2);
  std::vector<double> axis[3];
  for (std::int64_t n = 0; n < 90000; ++n) {
    const PoseReading r = pose.sample(n, AirframeState{}).reading;
    EXPECT_LT((r.p_W_m - c.offset_B_m - pose.drift_W_m()).norm(), 1e-15);
    for (int k = 0; k < 3; ++k) axis[k].push_back(pose.drift_W_m()[k]);
  }
  for (const auto& x : axis) {
    EXPECT_NEAR(test::rms(x), 0.005, 0.05 * 0.005);
    EXPECT_NEAR(test::correlation(x, 15), std::exp(-1.0), 0.05);
    EXPECT_NEAR(test::correlation(x, 30), std::exp(-2.0), 0.06);
  }
}
TEST(PoseDrift, IsStationaryFromTheFirstSample) {
  PoseConfig c = silent_pose();
  c.drift_m = 0.005;
  std::vector<double> first, later;
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    PoseSensor pose(c, seed);
    for (std::int64_t n = 0; n < 100; ++n) {
      pose.sample(n, AirframeState{});
      if (n == 0 || n == 99)
        for (int k = 0; k < 3; ++k) (n == 0 ? first : later).push_back(pose.drift_W_m()[k]);
    }
  }
  EXPECT_NEAR(test::rms(first), 0.005, 0.04 * 0.005);
  EXPECT_NEAR(test::rms(later), 0.005, 0.04 * 0.005);
}
TEST(PoseDrift, StepsAt200HzAreThoseOfTheSameProcess) {
  PoseConfig c = silent_pose();
  c.drift_m = 0.005;
  PoseSensor pose(c, 4);
  std::vector<double> step;
  Eigen::Vector3d previous = Eigen::Vector3d::Zero();
  for (std::int64_t n = 0; n < 8000; ++n) {
    pose.sample(n, AirframeState{});
    if (n > 0)
      for (int k = 0; k < 3; ++k) step.push_back(pose.drift_W_m()[k] - previous[k]);
    previous = pose.drift_W_m();
  }
  const double expected = 0.005 * std::sqrt(2.0 * (1.0 - std::exp(-0.005 / 15.0)));  // 0.13 mm
  EXPECT_NEAR(test::rms(step), expected, 0.02 * expected);
}
TEST(PoseDrift, SwitchedOffItIsZeroAndShiftsNoOtherNumber) {
  PoseConfig with, without;
  without.drift_enabled = false;
  PoseSensor a(with, 9), b(without, 9);
  for (std::int64_t n = 0; n < 50; ++n) {
    const PoseArrival x = a.sample(n, at(n * 5'000'000)), y = b.sample(n, at(n * 5'000'000));
    EXPECT_EQ(b.drift_W_m(), Eigen::Vector3d::Zero().eval());
    EXPECT_GT(a.drift_W_m().norm(), 0.0);
    EXPECT_LT((x.reading.p_W_m - a.drift_W_m() - y.reading.p_W_m).norm(), 1e-15);
    EXPECT_EQ(x.reading.v_W_m_s, y.reading.v_W_m_s);
    EXPECT_EQ(x.reading.q_WS.coeffs(), y.reading.q_WS.coeffs());
    EXPECT_EQ(x.arrival_time_ns, y.arrival_time_ns);
  }
}

TEST(PoseDelay, IsUniformFrom12To18Milliseconds) {
  PoseConfig c = silent_pose();
  c.rate_Hz = 20;  // far apart: no reading waits for the one before it
  PoseSensor pose(c, 3);
  std::vector<double> delay_ms;
  for (std::int64_t n = 0; n < 20000; ++n)
    delay_ms.push_back(static_cast<double>(pose.sample(n, at(n * 50'000'000)).arrival_time_ns - n * 50'000'000) * 1e-6);
  EXPECT_GE(*std::min_element(delay_ms.begin(), delay_ms.end()), 12.0 - 1e-5);
  EXPECT_LE(*std::max_element(delay_ms.begin(), delay_ms.end()), 18.0);
  EXPECT_NEAR(test::mean(delay_ms), 15.0, 0.05);
  EXPECT_LT(test::distance_from_uniform(delay_ms, 12.0, 18.0), 1.63 / std::sqrt(20000.0));  // 1 % level
  EXPECT_LT(std::fabs(test::correlation(
                [&] {
                  auto d = delay_ms;
                  for (double& v : d) v -= 15.0;
                  return d;
                }(),
                1)),
            0.03);
}
TEST(PoseDelay, At200HzTheOrderIsKeptWhereTheDrawsWouldBreakIt) {
  PoseSensor pose(PoseConfig{}, 3);
  std::int64_t previous = 0, waited = 0;
  for (std::int64_t n = 0; n < 20000; ++n) {
    const PoseArrival a = pose.sample(n, at(n * 5'000'000));
    EXPECT_GE(a.arrival_time_ns, previous);
    EXPECT_LE(a.arrival_time_ns - n * 5'000'000, 18'000'000);
    if (a.arrival_time_ns == previous) ++waited;
    previous = a.arrival_time_ns;
    while (pose.take(n * 5'000'000)) {
    }
  }
  // Two draws of +-3 ms differ by more than 5 ms in (1/6)^2/2 = 1.4 % of the cases: without the rule these would overtake.
  EXPECT_NEAR(static_cast<double>(waited) / 20000.0, 1.0 / 72.0, 0.003);
  EXPECT_EQ(pose.lost(), 0u);
}

TEST(PoseQueue, GivesEachReadingOnceAtItsArrivalAndNotBefore) {
  PoseSensor pose(PoseConfig{}, 3);
  EXPECT_FALSE(pose.next_arrival_ns().has_value());
  std::vector<PoseArrival> sent;
  for (std::int64_t n = 0; n < 3; ++n) sent.push_back(pose.sample(n, at(n * 5'000'000)));
  EXPECT_EQ(pose.under_way(), 3u);
  for (const PoseArrival& a : sent) {
    EXPECT_EQ(pose.next_arrival_ns(), a.arrival_time_ns);
    EXPECT_FALSE(pose.take(a.arrival_time_ns - 1).has_value());
    const auto got = pose.take(a.arrival_time_ns);
    ASSERT_TRUE(got.has_value());
    EXPECT_EQ(got->time_ns, a.reading.time_ns);
    EXPECT_EQ(got->p_W_m, a.reading.p_W_m);
  }
  EXPECT_FALSE(pose.take(1'000'000'000).has_value());
}
TEST(PoseQueue, WhatNobodyTakesIsCountedAndTheNewestStay) {
  PoseSensor pose(PoseConfig{}, 3);
  for (std::int64_t n = 0; n < 100; ++n) pose.sample(n, at(n * 5'000'000));
  EXPECT_EQ(pose.lost(), 100u - PoseSensor::kQueue);
  EXPECT_EQ(pose.take(1'000'000'000)->time_ns, (100 - static_cast<std::int64_t>(PoseSensor::kQueue)) * 5'000'000);
}
TEST(PoseSensor, DelaysThatCannotBeAreRefused) {
  PoseConfig early, crowded, negative, no_tau;
  early.jitter_s = 0.016;
  crowded.latency_s = 0.5;
  negative.latency_s = -0.001;
  no_tau.drift_tau_s = 0.0;
  for (const PoseConfig& c : {early, crowded, negative, no_tau}) EXPECT_THROW(PoseSensor(c, 1), Error);
}

// Defects that nobody declared.
TEST(PoseDefects, AStampErrorOf10MillisecondsMovesTheStampAndNothingElse) {
  PoseConfig c = silent_pose();
  c.stamp_error_s = 0.010;
  PoseSensor right(silent_pose(), 1), wrong(c, 1);
  AirframeState s = at(50'000'000);
  s.p_W_m = {1.0, 2.0, 3.0};
  const PoseReading a = right.sample(0, s).reading, b = wrong.sample(0, s).reading;
  EXPECT_EQ(b.time_ns - a.time_ns, 10'000'000);
  EXPECT_EQ(a.p_W_m, b.p_W_m);
  EXPECT_EQ(a.q_WS.coeffs(), b.q_WS.coeffs());
}
TEST(PoseDefects, StampJitterScattersTheStampsByItsSigma) {
  PoseConfig c = silent_pose();
  c.stamp_jitter_s = 0.002;
  PoseSensor sensor(c, 1);
  double squares = 0.0;
  for (int n = 0; n < 4000; ++n) {
    const AirframeState s = at(5'000'000 * static_cast<std::int64_t>(n));
    const double error_s = static_cast<double>(sensor.sample(n, s).reading.time_ns - s.time_ns) * 1e-9;
    squares += error_s * error_s;
  }
  EXPECT_NEAR(std::sqrt(squares / 4000), 0.002, 0.0001);
}
TEST(PoseDefects, AScaleErrorStretchesPositionAndVelocityAboutTheOrigin) {
  PoseConfig c = silent_pose();
  c.offset_B_m.setZero();
  c.scale_error = 0.02;
  AirframeState s = at(0);
  s.p_W_m = {1.0, 2.0, 3.0};
  s.v_W_m_s = {4.0, 0.0, 0.0};
  const PoseReading r = PoseSensor(c, 1).sample(0, s).reading;
  EXPECT_LT((r.p_W_m - 1.02 * s.p_W_m).norm(), 1e-14);
  EXPECT_LT((r.v_W_m_s - 1.02 * s.v_W_m_s).norm(), 1e-14);
}
TEST(PoseDefects, ATiltOfItsWorldAboutYReportsWhatLiesAheadTooLowAndALevelBodyNoseDown) {
  PoseConfig c = silent_pose();
  c.offset_B_m.setZero();
  c.tilt_rad = {0.0, 0.01};
  AirframeState s = at(0);
  s.p_W_m = {2.0, 0.0, 0.0};
  const PoseReading r = PoseSensor(c, 1).sample(0, s).reading;
  EXPECT_NEAR(r.p_W_m.z(), -0.02, 1e-6);
  EXPECT_NEAR((r.q_WS * Eigen::Vector3d::UnitX()).z(), -0.01, 1e-6);
  EXPECT_NEAR(r.p_W_m.norm(), 2.0, 1e-14);
}

}  // namespace
}  // namespace rotorloop::sim
