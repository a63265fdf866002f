// Frame lengths against sequences counted by hand and against a second, bit-by-bit implementation written from the standard.
#include "host/bus/frame_bits.hpp"

#include <gtest/gtest.h>

#include <string>

namespace rotorloop {
namespace {

CanFrame frame_of(std::uint32_t id, bool extended, std::initializer_list<int> data) {
  CanFrame f{.id = id, .extended = extended, .length = static_cast<std::uint8_t>(data.size())};
  std::size_t i = 0;
  for (const int byte : data) f.data[i++] = static_cast<std::uint8_t>(byte);
  return f;
}

// The sequence from start of frame to CRC as text, one character per bit; slow and plain on purpose.
std::string bits_of(std::uint32_t value, int count) {
  std::string s;
  for (int i = count - 1; i >= 0; --i) s += (value >> i & 1u) != 0 ? '1' : '0';
  return s;
}

std::string unstuffed_sequence(const CanFrame& f) {
  std::string s = "0";
  if (f.extended) {
    s += bits_of(f.id >> 18, 11) + "11" + bits_of(f.id, 18) + "000";
  } else {
    s += bits_of(f.id, 11) + "000";
  }
  s += bits_of(f.length, 4);
  for (std::size_t i = 0; i < f.length; ++i) s += bits_of(f.data[i], 8);
  std::uint32_t crc = 0;  // ISO 11898-1 §10.4.2.6, the register as the standard describes it
  for (const char bit : s) {
    const bool next = (bit == '1') != ((crc >> 14 & 1u) != 0);
    crc = crc << 1 & 0x7FFFu;
    if (next) crc ^= 0x4599u;
  }
  return s + bits_of(crc, 15);
}

std::string stuffed(const std::string& s) {
  std::string out;
  int run = 0;
  for (const char bit : s) {
    run = !out.empty() && out.back() == bit ? run + 1 : 1;
    out += bit;
    if (run == 5) {
      out += bit == '0' ? '1' : '0';
      run = 1;
    }
  }
  return out;
}

TEST(FrameBits, EmptyFrameOfIdZeroIs34DominantBitsWith6StuffBits50InAll) {
  // SOF, 11 id, RTR, IDE, r0, 4 DLC, 15 CRC bits: 34 zeros. A 1 after every fifth: 6. Tail 10.
  EXPECT_EQ(stuff_bits(frame_of(0, false, {})), 6);
  EXPECT_EQ(frame_bits(frame_of(0, false, {})), 34 + 6 + 10);
}

TEST(FrameBits, AlternatingFrameHasNoStuffBitInHeaderOrData) {
  // 0 10101010101 000 1000 01010101…: the longest run is 0001 000 0: four equal bits. What remains is up to the CRC.
  const CanFrame f = frame_of(0x555, false, {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55});
  const std::string all = unstuffed_sequence(f);
  EXPECT_EQ(stuffed(all.substr(0, 19 + 64)).size(), 19u + 64u);
  EXPECT_LE(stuff_bits(f), 3);
  EXPECT_EQ(frame_bits(f), static_cast<int>(stuffed(all).size()) + kFrameTailBits);
}

TEST(FrameBits, ZeroDataCostSixteenStuffBitsBeforeTheCrc) {
  // 15 zeros up to the DLC: 3. DLC 1000 and 64 zeros: 67 zeros after the 1: 13.
  const CanFrame f = frame_of(0, false, {0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(stuffed(unstuffed_sequence(f).substr(0, 19 + 64)).size(), 19u + 64u + 16u);
  EXPECT_EQ(frame_bits(f), static_cast<int>(stuffed(unstuffed_sequence(f)).size()) + kFrameTailBits);
}

TEST(FrameBits, FourThousandRandomFramesEqualTheBitByBitReference) {
  std::uint64_t state = 1;
  const auto next = [&] { return state = state * 6364136223846793005ull + 1442695040888963407ull, state >> 33; };
  for (int n = 0; n < 4000; ++n) {
    CanFrame f;
    f.extended = next() % 2 == 0;
    f.id = static_cast<std::uint32_t>(next()) & (f.extended ? 0x1FFFFFFFu : 0x7FFu);
    f.length = static_cast<std::uint8_t>(next() % 9);
    // Long runs are where stuffing happens: half of the bytes are 00, FF, 0F or F0.
    for (std::size_t i = 0; i < f.length; ++i) {
      constexpr std::uint8_t kRuns[] = {0x00, 0xFF, 0x0F, 0xF0};
      f.data[i] = next() % 2 == 0 ? kRuns[next() % 4] : static_cast<std::uint8_t>(next());
    }
    const std::string all = unstuffed_sequence(f);
    ASSERT_EQ(bits_of(frame_crc15(f), 15), all.substr(all.size() - 15)) << "frame " << n;
    ASSERT_EQ(frame_bits(f), static_cast<int>(stuffed(all).size()) + kFrameTailBits) << "frame " << n;
    ASSERT_LE(frame_bits(f) + kIntermissionBits, static_cast<int>(worst_frame_bits(f.extended, f.length))) << "frame " << n;
  }
}

TEST(FrameBits, AStuffBitFollowsTheCrcWhenItsLastFiveBitsAreEqual) {
  // Found among frames with two data bytes: the CRC ends in five equal bits that begin a run of their own.
  bool found = false;
  for (int value = 0; value < 65536 && !found; ++value) {
    const CanFrame f = frame_of(0x123, false, {value >> 8, value & 0xFF});
    const std::string with = stuffed(unstuffed_sequence(f));
    const std::string without_last = stuffed(unstuffed_sequence(f).substr(0, 34 + 16 - 1));
    found = with.size() == without_last.size() + 2;
    if (found) {
      EXPECT_EQ(frame_bits(f), static_cast<int>(with.size()) + kFrameTailBits);
    }
  }
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace rotorloop
