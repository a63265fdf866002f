// MAVLink 2 as PX4's simulator interface has it: published checksum bytes made anew from the field lists, frames found in a broken stream.
#include "bench/hil/controllers/mavlink.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace rotorloop::hil::mavlink {
namespace {

TEST(Mavlink, ChecksumOfTheX25SpecificationIs906E) { EXPECT_EQ(static_cast<std::uint16_t>(~x25(0xFFFF, "123456789")), 0x906E); }

TEST(Mavlink, ExtraBytesMadeFromTheFieldsAreThePublishedOnes) {
  EXPECT_EQ(extra_byte(kHilActuatorControls), 47);
  EXPECT_EQ(extra_byte(kHilRcInputsRaw), 54);
  EXPECT_EQ(extra_byte(kHilSensor), 108);
  EXPECT_EQ(extra_byte(kHilGps), 124);
  EXPECT_EQ(
      extra_byte({0, "HEARTBEAT",
                  "uint32_t custom_mode uint8_t type uint8_t autopilot uint8_t base_mode uint8_t system_status uint8_t mavlink_version ",
                  9}),
      50);
}

Payload controls(float first, std::uint8_t mode) {
  Payload p;
  p.add(std::uint64_t{123'456}).add(std::uint64_t{0}).add(first);
  for (int i = 1; i < 16; ++i) p.add(0.0f);
  p.add(mode);
  return p;
}

TEST(Mavlink, ZerosAtTheEndAreLeftOutAndPutBack) {
  const auto bytes = frame(kHilActuatorControls, controls(0.5f, 0), 7);
  EXPECT_EQ(bytes.size(), 10u + 20u + 2u);
  Finder finder(kHilActuatorControls);
  finder.add(bytes);
  std::vector<std::uint8_t> payload;
  ASSERT_TRUE(finder.next(payload));
  EXPECT_EQ(payload, controls(0.5f, 0).bytes());
  EXPECT_FALSE(finder.next(payload));
}

TEST(Mavlink, OneIsFoundBehindNoiseAnotherMessageAndADamagedOneHoweverItIsCut) {
  std::vector<std::uint8_t> stream{1, 2, 3};
  const auto put = [&](const std::vector<std::uint8_t>& f) { stream.insert(stream.end(), f.begin(), f.end()); };
  put(frame(kHilGps, Payload().add(std::uint64_t{1}), 0));
  auto damaged = frame(kHilActuatorControls, controls(0.25f, 128), 1);
  damaged[20] ^= 1;
  put(damaged);
  put(frame(kHilActuatorControls, controls(0.75f, 128), 2));
  Finder finder(kHilActuatorControls);
  std::vector<std::uint8_t> payload;
  int found = 0;
  for (const std::uint8_t b : stream) {
    finder.add({&b, 1});
    while (finder.next(payload)) {
      ++found;
      float first = 0.0f;
      std::memcpy(&first, payload.data() + 16, sizeof first);
      EXPECT_EQ(first, 0.75f);
    }
  }
  EXPECT_EQ(found, 1);
}

}  // namespace
}  // namespace rotorloop::hil::mavlink
