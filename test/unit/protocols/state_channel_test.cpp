// The state channel: resolutions that a controller relies on, assembly of samples, reconstruction of time.
#include "protocols/state_channel.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "host/base/random.hpp"
#include "protocols/state_receiver.hpp"

namespace rotorloop::protocols::state {
namespace {

constexpr std::uint64_t kSeed = 7;

std::array<double, 4> random_attitude(const RandomStream& random, std::uint64_t i) {
  std::array<double, 4> q{};
  double norm2 = 0.0;
  for (std::size_t k = 0; k < 4; ++k) {
    q[k] = random.gaussian(4 * i + k);
    norm2 += q[k] * q[k];
  }
  for (double& c : q) c /= std::sqrt(norm2);
  return q;
}

// Angle between two attitudes from the vector part of their difference: exact for small angles.
double angle_rad(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  const double x = a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2];
  const double y = a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1];
  const double z = a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0];
  return 2.0 * std::asin(std::min(1.0, std::sqrt(x * x + y * y + z * z)));
}

TEST(StateChannel, ImuKeepsItsResolutionOverTheWholeRange) {
  const RandomStream random(kSeed, 1);
  for (std::uint64_t i = 0; i < 5000; ++i) {
    ImuReading s{.time_us = static_cast<std::int64_t>(i) * 997};
    for (std::size_t k = 0; k < 3; ++k) {
      s.gyro_B_rad_s[k] = 70.0 * random.uniform(6 * i + k) - 35.0;
      s.accel_B_m_s2[k] = 320.0 * random.uniform(6 * i + 3 + k) - 160.0;
    }
    const ImuReading b = decode(encode(s, static_cast<std::uint8_t>(i % 64)));
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(b.gyro_B_rad_s[k], s.gyro_B_rad_s[k], 0.5001 * 35.0 / 32767.0);
      EXPECT_NEAR(b.accel_B_m_s2[k], s.accel_B_m_s2[k], 0.5001 * 160.0 / 32767.0);
    }
    EXPECT_EQ(b.time_us, s.time_us % (1 << 20));
  }
}

TEST(StateChannel, ImuBeyondItsRangeClampsAndNaNBecomesZero) {
  const ImuReading b =
      decode(encode(ImuReading{.time_us = 0, .gyro_B_rad_s = {100.0, -100.0, std::nan("")}, .accel_B_m_s2 = {1e9, -1e9, 0.0}}, 0));
  EXPECT_NEAR(b.gyro_B_rad_s[0], 35.0, 1e-9);
  EXPECT_NEAR(b.gyro_B_rad_s[1], -35.0, 1e-9);
  EXPECT_EQ(b.gyro_B_rad_s[2], 0.0);
  EXPECT_NEAR(b.accel_B_m_s2[1], -160.0, 1e-9);
}

TEST(StateChannel, PositionIsGoodToATenthOfAMillimetreOver400m) {
  const RandomStream random(kSeed, 2);
  for (std::uint64_t i = 0; i < 5000; ++i) {
    PoseReading s{.time_us = static_cast<std::int64_t>(random.bits(i) & 0xFFFFFFFFu)};
    for (std::size_t k = 0; k < 3; ++k) {
      s.p_W_m[k] = 800.0 * random.uniform(10000 + 3 * i + k) - 400.0;
      s.v_W_m_s[k] = 64.0 * random.uniform(90000 + 3 * i + k) - 32.0;
    }
    s.tracking = (i & 1) != 0;
    s.relocalised = (i & 2) != 0;
    const PoseReading b = decode(encode(s, 0));
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(b.p_W_m[k], s.p_W_m[k], 0.026e-3);
      EXPECT_NEAR(b.v_W_m_s[k], s.v_W_m_s[k], 0.501e-3);
    }
    EXPECT_EQ(b.time_us, s.time_us);
    EXPECT_EQ(b.tracking, s.tracking);
    EXPECT_EQ(b.relocalised, s.relocalised);
  }
}

TEST(StateChannel, AttitudeIsGoodTo1e5RadForAnyAttitude) {
  const RandomStream random(kSeed, 3);
  double worst = 0.0;
  for (std::uint64_t i = 0; i < 100000; ++i) {
    PoseReading s;
    s.q_WS = random_attitude(random, i);
    worst = std::max(worst, angle_rad(s.q_WS, decode(encode(s, 0)).q_WS));
  }
  // The worst corner: all components nearly equal, with rounding errors that add up.
  for (int i = 0; i < 20000; ++i) {
    const double e = i * 1e-9;
    PoseReading s;
    s.q_WS = {0.5 + 3.0 * e, 0.5 - e, 0.5 - e, 0.5 - e};
    const double norm = std::sqrt(s.q_WS[0] * s.q_WS[0] + 3.0 * s.q_WS[1] * s.q_WS[1]);
    for (double& c : s.q_WS) c /= norm;
    worst = std::max(worst, angle_rad(s.q_WS, decode(encode(s, 0)).q_WS));
  }
  EXPECT_LT(worst, 1e-5);
  EXPECT_GT(worst, 4e-6) << "the corner case is not being exercised";
}

TEST(StateChannel, AttitudeAndItsNegativeAreTheSameAndAZeroQuaternionIsNoRotation) {
  PoseReading a, b, zero;
  a.q_WS = {-0.5, 0.5, 0.5, -0.5};
  b.q_WS = {0.5, -0.5, -0.5, 0.5};
  EXPECT_EQ(encode(a, 3), encode(b, 3));
  zero.q_WS = {0.0, 0.0, 0.0, 0.0};
  EXPECT_EQ(decode(encode(zero, 0)).q_WS, (std::array<double, 4>{1.0, 0.0, 0.0, 0.0}));
  a.q_WS = {2.0, 0.0, 0.0, 0.0};
  EXPECT_EQ(decode(encode(a, 0)).q_WS, (std::array<double, 4>{1.0, 0.0, 0.0, 0.0}));
}

TEST(StateChannel, SetpointRoundTripsAndYawIsModuloOneTurn) {
  constexpr double kPi = 3.14159265358979323846;
  TrackingSetpoint s{.time_us = 123456, .p_W_m = {1.0, -2.0, 3.0}, .v_W_m_s = {-4.0, 5.0, -6.0}, .yaw_rad = 0.0};
  for (double yaw = -9.0; yaw < 9.0; yaw += 0.037) {
    s.yaw_rad = yaw;
    const TrackingSetpoint b = decode(encode(s, 9));
    const double error = std::remainder(b.yaw_rad - yaw, 2.0 * kPi);
    EXPECT_NEAR(error, 0.0, 0.501 * kYawLsb_rad);
    EXPECT_LE(std::fabs(b.yaw_rad), kPi);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(b.p_W_m[k], s.p_W_m[k], 0.026e-3);
      EXPECT_NEAR(b.v_W_m_s[k], s.v_W_m_s[k], 0.501e-3);
    }
    EXPECT_EQ(b.time_us, 123456);
  }
  s.yaw_rad = std::numeric_limits<double>::infinity();
  EXPECT_EQ(decode(encode(s, 0)).yaw_rad, 0.0);
}

TEST(StateChannel, ControllerStatusRoundTrips) {
  ControllerStatus s{.time_us = 1048575,
                     .mode = ControllerMode::tracking,
                     .armed = true,
                     .estimate_valid = true,
                     .pose_fresh = false,
                     .imu_fresh = true,
                     .limiters = kLimitMotorMax | kLimitTilt | kLimitIntegral,
                     .motor_limited_count = 65535,
                     .thrust_limited_count = 1,
                     .attitude_limited_count = 32768};
  EXPECT_EQ(decode_status(encode(s, 15)), s);
  s = {};
  s.pose_fresh = true;
  EXPECT_EQ(decode_status(encode(s, 0)), s);
}

class Receiving : public ::testing::Test {
 protected:
  // Frames arrive 150 µs apart; events are collected.
  template <std::size_t N>
  void feed(const std::array<CanFrame, N>& frames, std::int64_t now_us, std::uint32_t lost_mask = 0) {
    for (std::size_t i = 0; i < N; ++i) {
      if ((lost_mask >> i & 1u) != 0) continue;
      const StateEvent e = receiver_.on_frame(frames[i], now_us + 150 * static_cast<std::int64_t>(i));
      if (e.imu) imu_.push_back(*e.imu);
      if (e.pose) pose_.push_back(*e.pose);
    }
  }
  StateReceiver receiver_;
  std::vector<ImuReading> imu_;
  std::vector<PoseReading> pose_;
};

TEST_F(Receiving, SampleComesOnlyWhenAllItsFramesCame) {
  for (std::uint8_t missing = 0; missing < 4; ++missing) {
    feed(encode(PoseReading{.time_us = 5000 * missing}, missing), 5000 * missing, 1u << missing);
  }
  EXPECT_TRUE(pose_.empty());
  feed(encode(PoseReading{.time_us = 20000}, 4), 20000);
  ASSERT_EQ(pose_.size(), 1u);
  EXPECT_EQ(pose_[0].time_us, 20000);
  EXPECT_EQ(receiver_.pose_counters().incomplete, 4u);
}

TEST_F(Receiving, FramesOfDifferentSamplesAreNeverMixed) {
  // Gyro of one sample, accelerometer of the next: without the sequence this would pass as one reading.
  ImuReading a, b;
  a.gyro_B_rad_s = {1, 1, 1};
  b.accel_B_m_s2 = {9, 9, 9};
  feed(encode(a, 5), 0, 2u);
  feed(encode(b, 6), 1000, 1u);
  EXPECT_TRUE(imu_.empty());
  EXPECT_EQ(receiver_.imu_counters().incomplete, 1u);
}

TEST_F(Receiving, SameSequenceOneWrapLaterIsNotMixedEither) {
  feed(encode(ImuReading{.time_us = 0}, 5), 0, 2u);
  feed(encode(ImuReading{.time_us = 64000}, 5), 64000, 1u);
  EXPECT_TRUE(imu_.empty());
}

TEST_F(Receiving, LossesAreCountedBySequence) {
  for (int i = 0; i < 200; ++i) {
    const bool drop = i % 10 == 3;  // whole samples
    feed(encode(ImuReading{.time_us = 1000 * i}, static_cast<std::uint8_t>(i % 64)), 1000 * i, drop ? 3u : 0u);
  }
  EXPECT_EQ(receiver_.imu_counters().complete, 180u);
  EXPECT_EQ(receiver_.imu_counters().lost, 20u);
  EXPECT_EQ(receiver_.imu_counters().incomplete, 0u);
}

TEST_F(Receiving, RepeatedFramesAreCountedAndDeliverNothingTwice) {
  const ImuFrames f = encode(ImuReading{.time_us = 1000}, 1);
  feed(std::array<CanFrame, 5>{f[0], f[0], f[1], f[1], f[0]}, 1000);
  EXPECT_EQ(imu_.size(), 1u);
  EXPECT_EQ(receiver_.imu_counters().duplicate, 3u);
  feed(encode(ImuReading{.time_us = 2000}, 2), 2000);
  EXPECT_EQ(imu_.size(), 2u);
  EXPECT_EQ(receiver_.imu_counters().incomplete, 0u);
}

TEST_F(Receiving, ShortFramesAreMalformed) {
  CanFrame f = encode(ImuReading{}, 1)[0];
  f.length = 7;
  receiver_.on_frame(f, 0);
  EXPECT_EQ(receiver_.imu_counters().malformed, 1u);
}

TEST_F(Receiving, ImuTimeIsRestoredAfterThePoseGaveTheFullStamp) {
  // Airframe clock far from the receiver's; pose 18 ms old on arrival.
  constexpr std::int64_t kAirframe = 3'000'000'123, kReceiver = 77;
  feed(encode(PoseReading{.time_us = kAirframe - 18'000}, 0), kReceiver);
  EXPECT_TRUE(receiver_.clock().anchored);
  for (int i = 0; i < 5000; ++i)
    feed(encode(ImuReading{.time_us = kAirframe + 1000 * i}, static_cast<std::uint8_t>(i % 64)), kReceiver + 1000 * i);
  ASSERT_EQ(imu_.size(), 5000u);
  for (int i = 0; i < 5000; ++i) ASSERT_EQ(imu_[static_cast<std::size_t>(i)].time_us, kAirframe + 1000 * i);
  EXPECT_EQ(pose_.at(0).time_us, kAirframe - 18'000);
}

TEST_F(Receiving, TimeSurvivesAGapOf10sAndADriftingReceiverClock) {
  receiver_.anchor(0, 0);
  std::int64_t airframe = 0;
  std::uint8_t sequence = 0;
  const auto sample = [&](std::int64_t at) {
    feed(encode(ImuReading{.time_us = at}, sequence++ % 64), at + at / 10000);  // 100 ppm fast
    ASSERT_EQ(imu_.back().time_us, at);
  };
  for (; airframe < 2'000'000; airframe += 1000) sample(airframe);
  for (airframe += 10'000'000; airframe < 13'000'000; airframe += 1000) sample(airframe);
}

TEST_F(Receiving, PoseTimeContinuesBeyondTheWrapOf32Bits) {
  receiver_.anchor((std::int64_t{1} << 32) - 10'000, 0);
  for (int i = 0; i < 5; ++i)
    feed(encode(PoseReading{.time_us = (std::int64_t{1} << 32) - 10'000 + 5000 * i}, static_cast<std::uint8_t>(i)), 5000 * i);
  ASSERT_EQ(pose_.size(), 5u);
  EXPECT_EQ(pose_[4].time_us, (std::int64_t{1} << 32) + 10'000);
}

TEST_F(Receiving, StampOfASampleOlderThanTheExpectationIsRestoredToo) {
  receiver_.anchor(1'048'576 + 100, 0);  // just behind the wrap of 20 bits
  feed(encode(ImuReading{.time_us = 1'048'576 - 200}, 0), 0);
  ASSERT_EQ(imu_.size(), 1u);
  EXPECT_EQ(imu_[0].time_us, 1'048'576 - 200);
}

TEST(StateChannel, PoseAndStatusOfAnotherVersionAreRefusedAndBothNumbersKnown) {
  StateReceiver receiver;
  auto pose = encode(PoseReading{.time_us = 1000, .tracking = true}, 3);
  auto status = encode(ControllerStatus{.time_us = 1000}, 3);
  pose[1].data[6] = 7;
  status[1].data[6] = 0;
  for (const CanFrame& f : pose) EXPECT_FALSE(receiver.on_frame(f, 1000).pose);
  EXPECT_EQ(receiver.foreign_version(), 7);
  for (const CanFrame& f : status) EXPECT_FALSE(receiver.on_frame(f, 1000).status);
  EXPECT_EQ(receiver.foreign_version(), 0);
  EXPECT_EQ(receiver.refused_for_version(), 2u);
  std::size_t heard = 0;
  for (const CanFrame& f : encode(PoseReading{.time_us = 2000, .tracking = true}, 4)) heard += receiver.on_frame(f, 2000).pose ? 1u : 0u;
  EXPECT_EQ(heard, 1u);
}

}  // namespace
}  // namespace rotorloop::protocols::state
