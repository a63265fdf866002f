// The bit order, the casts and float16, against documented bytes and by properties over all values.
#include "protocols/bits.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "host/base/random.hpp"
#include "test/unit/protocols/hex.hpp"

namespace rotorloop::protocols {
namespace {

TEST(BitCodec, ValueOf14BitsGoesLowByteFirstThenItsSixHighBits) {
  std::array<std::uint8_t, 2> out{};
  BitWriter w(out);
  w.put_signed_saturated(0x1ABC, 14);  // 01 1010 1011 1100
  EXPECT_EQ(hex(out), "bc68");         // bc, then 011010 and two bits of padding
  EXPECT_EQ(w.bytes(), 2u);
}

TEST(BitCodec, EveryWidthAndOffsetRoundTrips) {
  const RandomStream random(1, 1);
  std::uint64_t n = 0;
  for (unsigned offset = 0; offset < 8; ++offset) {
    for (unsigned bits = 1; bits <= 64; ++bits) {
      const std::uint64_t value = random.bits(n++) >> (64u - bits);
      std::array<std::uint8_t, 10> buffer;
      buffer.fill(0xA5);  // stale memory must not shine through
      BitWriter w(buffer);
      w.put(0, offset);
      w.put(value, bits);
      w.put(1, 1);
      ASSERT_FALSE(w.overflow());
      BitReader r(std::span<const std::uint8_t>(buffer.data(), w.bytes()));
      EXPECT_EQ(r.get(offset), 0u);
      EXPECT_EQ(r.get(bits), value) << bits << " bits at " << offset;
      EXPECT_EQ(r.get(1), 1u);
      EXPECT_EQ(r.get(static_cast<unsigned>(r.remaining_bits())), 0u) << "padding must be zero";
      EXPECT_FALSE(r.missing());
    }
  }
}

TEST(BitCodec, EncoderSaturatesWhereTruncationWouldReverseTheMotor) {
  std::array<std::uint8_t, 2> out{};
  BitWriter(out).put_signed_saturated(9000, 14);
  EXPECT_EQ(BitReader(out).get_signed(14), 8191);
  BitWriter(out).put_signed_saturated(-9000, 14);
  EXPECT_EQ(BitReader(out).get_signed(14), -8192);
  BitWriter(out).put_saturated(200, 7);
  EXPECT_EQ(BitReader(out).get(7), 127u);
  BitWriter(out).put(9000u, 14);  // the damage without saturation
  EXPECT_EQ(BitReader(out).get_signed(14), 9000 - 16384);
}

TEST(BitCodec, FullBufferIsReportedAndNothingIsWrittenBeyond) {
  std::array<std::uint8_t, 4> memory{};
  memory.fill(0x77);
  BitWriter w(std::span<std::uint8_t>(memory.data(), 2));
  w.put(0xFFFF, 13);
  EXPECT_FALSE(w.overflow());
  w.put(0xF, 4);
  EXPECT_TRUE(w.overflow());
  EXPECT_EQ(memory[2], 0x77);
  EXPECT_EQ(memory[3], 0x77);
}

TEST(BitCodec, ReaderGivesZerosBeyondTheEndAndSaysSo) {
  const std::array<std::uint8_t, 2> memory{0xFF, 0xFF};
  BitReader r(std::span<const std::uint8_t>(memory.data(), 1));
  EXPECT_EQ(r.get(12), 0x0FFu) << "the byte behind the payload is not read";
  EXPECT_TRUE(r.missing());
}

TEST(Float16, AllFinitePatternsSurviveTheRoundTrip) {
  for (std::uint32_t h = 0; h < 0x10000; ++h) {
    const auto half = static_cast<std::uint16_t>(h);
    const float value = from_float16(half);
    if (std::isnan(value)) {
      EXPECT_EQ(to_float16(value), 0x7FFF);
    } else {
      EXPECT_EQ(to_float16(value), half) << h;
    }
  }
}

TEST(Float16, RoundsToNearestWithHalvesAwayFromZero) {
  for (std::uint32_t h = 0; h < 0x7BFF; ++h) {
    const float low = from_float16(static_cast<std::uint16_t>(h)), high = from_float16(static_cast<std::uint16_t>(h + 1));
    const float middle = 0.5f * (low + high);  // exact: one bit more than float16 has
    EXPECT_EQ(to_float16(middle), h + 1) << h;
    EXPECT_EQ(to_float16(-middle), 0x8000u | (h + 1)) << h;
    EXPECT_EQ(to_float16(std::nextafter(middle, 0.0f)), h) << h;
  }
}

TEST(Float16, FiniteValuesClampTo65504AndInfinitiesStay) {
  EXPECT_EQ(from_float16(to_float16(1e9f)), 65504.0f);
  EXPECT_EQ(from_float16(to_float16(-65519.0f)), -65504.0f);
  EXPECT_EQ(from_float16(to_float16(std::numeric_limits<float>::max())), 65504.0f);
  EXPECT_EQ(to_float16(std::numeric_limits<float>::infinity()), 0x7C00);
  EXPECT_EQ(to_float16(-std::numeric_limits<float>::infinity()), 0xFC00);
  EXPECT_EQ(to_float16(std::numeric_limits<float>::denorm_min()), 0);
}

}  // namespace
}  // namespace rotorloop::protocols
