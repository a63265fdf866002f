// The fast channel: bits, scales, special values.
#include "protocols/fast_channel.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host/base/random.hpp"

namespace rotorloop::protocols::fast {
namespace {

TEST(FastChannel, EverySetpointValueOfEverySlotRoundTrips) {
  for (int value = -16384; value <= 16383; ++value) {
    Setpoint s{.mode = SetpointMode::duty, .group = 2, .sequence = static_cast<std::uint8_t>(value & 15)};
    s.raw = {static_cast<std::int16_t>(value), static_cast<std::int16_t>(-1 - value), static_cast<std::int16_t>(value / 2), kNoOrder};
    const auto back = decode_setpoint(encode(s));
    ASSERT_TRUE(back);
    ASSERT_EQ(*back, s);
  }
}

TEST(FastChannel, ScalesAreTwoRpmFullDutyAndTenMilliamperes) {
  Setpoint s{.mode = SetpointMode::rpm};
  s.set(0, 8950.0f * kRadPerSecondPerRpm);
  EXPECT_EQ(s.raw[0], 4475);
  s.mode = SetpointMode::duty;
  s.set(1, -1.0f);
  EXPECT_EQ(s.raw[1], -16383);
  s.mode = SetpointMode::current;
  s.set(2, 12.34f);
  EXPECT_EQ(s.raw[2], 1234);
}

TEST(FastChannel, ResolutionIsHalfAnLsbOverTheWholeRange) {
  for (const SetpointMode mode : {SetpointMode::rpm, SetpointMode::duty, SetpointMode::current}) {
    const float lsb = setpoint_lsb(mode);
    for (float x = -16383.0f; x <= 16383.0f; x += 7.3f) {
      Setpoint s{.mode = mode};
      s.set(3, x * lsb);
      EXPECT_NEAR(s.get(3) / lsb, x, 0.51f);
    }
  }
}

TEST(FastChannel, OutOfRangeClampsAndNaNIsNoOrder) {
  Setpoint s{.mode = SetpointMode::rpm};
  s.set(0, 1e9f);
  s.set(1, -std::numeric_limits<float>::infinity());
  s.set(2, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(s.raw[0], 16383);
  EXPECT_EQ(s.raw[1], -16383) << "the clamp must not reach the value that means no order";
  EXPECT_EQ(s.raw[2], kNoOrder);
  EXPECT_TRUE(std::isnan(decode_setpoint(encode(s))->get(2)));
  s.raw[3] = 32767;
  EXPECT_EQ(decode_setpoint(encode(s))->raw[3], 16383) << "the encoder saturates raw values too";
}

TEST(FastChannel, FeedbackInBothLengthsRoundTrips) {
  const RandomStream random(2, 1);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const std::uint64_t r = random.bits(i);
    Feedback f;
    f.esc_index = r & 15;
    f.sequence = r >> 4 & 15;
    f.speed_rpm = static_cast<std::int16_t>(r >> 8);
    f.current_50mA = static_cast<std::int16_t>(static_cast<int>(r >> 24 & 0xFFF) - 2048);
    if ((r >> 40 & 1) != 0) f.bus_10mV = static_cast<std::uint16_t>(r >> 48);
    const CanFrame frame = encode(f);
    EXPECT_EQ(frame.length, f.bus_10mV ? 6 : 4);
    const auto back = decode_feedback(frame);
    ASSERT_TRUE(back);
    ASSERT_EQ(*back, f);
  }
}

TEST(FastChannel, UnknownSpeedIsMarkedAndAFastMotorNeverLooksUnknown) {
  Feedback f;
  f.set_speed_rad_s(std::numeric_limits<float>::quiet_NaN());
  EXPECT_FALSE(f.speed_valid());
  EXPECT_TRUE(std::isnan(f.speed_rad_s()));
  f.set_speed_rad_s(-1e6f);
  EXPECT_TRUE(f.speed_valid());
  EXPECT_EQ(f.speed_rpm, -32767);
  f.set_speed_rad_s(1000.0f);
  EXPECT_NEAR(f.speed_rad_s(), 1000.0f, 0.5f * kFeedbackSpeedLsb_rad_s);
  f.set_current_A(-40.02f);
  EXPECT_NEAR(f.current_A(), -40.02f, 0.026f);
  f.set_bus_V(16.8f);
  EXPECT_EQ(*f.bus_10mV, 1680);
}

TEST(FastChannel, ForeignFramesAreNotDecoded) {
  CanFrame s = encode(Setpoint{}), f = encode(Feedback{});
  EXPECT_FALSE(decode_feedback(s));
  EXPECT_FALSE(decode_setpoint(f));
  for (std::uint8_t length = 0; length < 8; ++length) {
    s.length = f.length = length;
    EXPECT_FALSE(decode_setpoint(s));
    EXPECT_EQ(decode_feedback(f).has_value(), length == 4 || length == 6);
  }
  s = encode(Setpoint{});
  s.id |= 3u << 2;
  EXPECT_FALSE(decode_setpoint(s)) << "mode 3 is reserved";
  s = encode(Setpoint{});
  s.extended = true;
  EXPECT_FALSE(decode_setpoint(s));
}

TEST(FastChannel, SequenceDistanceWrapsAt16) {
  EXPECT_EQ(sequence_ahead(0, 15), 1);
  EXPECT_EQ(sequence_ahead(3, 3), 0);
  EXPECT_EQ(sequence_ahead(2, 3), 15);
}

}  // namespace
}  // namespace rotorloop::protocols::fast
