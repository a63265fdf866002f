// Frames against the examples of the specifications, and what their CRC sees: every pattern of up to three flipped bits.
#include "bench/stand/instruments/frame.hpp"

#include <gtest/gtest.h>

#include <array>

namespace rotorloop::modbus {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(ModbusFrame, CrcOfAKnownRequestIsLowByteFirst) {
  // 01 03 00 00 00 02 C4 0B: the most printed Modbus frame there is
  EXPECT_EQ(rtu_frame(1, request_pdu({1, 3, 0, 2, {}})), (Bytes{0x01, 0x03, 0x00, 0x00, 0x00, 0x02, 0xC4, 0x0B}));
}

TEST(ModbusFrame, PdusOfTheApplicationProtocolSpecification) {
  EXPECT_EQ(request_pdu({1, 3, 0x006B, 3, {}}), (Bytes{0x03, 0x00, 0x6B, 0x00, 0x03}));   // 6.3
  EXPECT_EQ(request_pdu({1, 4, 0x0008, 1, {}}), (Bytes{0x04, 0x00, 0x08, 0x00, 0x01}));   // 6.4
  EXPECT_EQ(request_pdu({1, 6, 0x0001, 1, {3}}), (Bytes{0x06, 0x00, 0x01, 0x00, 0x03}));  // 6.6
  EXPECT_EQ(request_pdu({1, 16, 0x0001, 2, {0x000A, 0x0102}}),
            (Bytes{0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02}));  // 6.12
  const Reply r = read_reply({1, 3, 0x006B, 3, {}}, Bytes{0x03, 0x06, 0x02, 0x2B, 0x00, 0x00, 0x00, 0x64});
  EXPECT_EQ(r.failure, Failure::none);
  EXPECT_EQ(r.registers, (std::vector<std::uint16_t>{555, 0, 100}));
  EXPECT_EQ(read_reply({1, 16, 1, 2, {10, 258}}, Bytes{0x10, 0x00, 0x01, 0x00, 0x02}).failure, Failure::none);
}

TEST(ModbusFrame, MbapHeaderHoldsNumberLengthAndUnit) {
  EXPECT_EQ(tcp_frame(0x1501, 0xFF, request_pdu({0xFF, 3, 4, 1, {}})),
            (Bytes{0x15, 0x01, 0x00, 0x00, 0x00, 0x06, 0xFF, 0x03, 0x00, 0x04, 0x00, 0x01}));
}

TEST(ModbusFrame, AnAnswerToSomethingElseIsMalformedAndARefusalKeepsItsCode) {
  const Request two{1, 3, 0, 2, {}};
  EXPECT_EQ(read_reply(two, Bytes{0x03, 0x02, 0, 1}).failure, Failure::malformed);                // one register
  EXPECT_EQ(read_reply(two, Bytes{0x04, 0x04, 0, 1, 0, 2}).failure, Failure::malformed);          // another function
  EXPECT_EQ(read_reply(two, Bytes{0x03, 0x06, 0, 1, 0, 2}).failure, Failure::malformed);          // a length that is not there
  EXPECT_EQ(read_reply({1, 6, 5, 1, {7}}, Bytes{0x06, 0, 5, 0, 8}).failure, Failure::malformed);  // wrote something else
  const Reply refused = read_reply(two, Bytes{0x83, 0x02});
  EXPECT_EQ(refused.failure, Failure::exception);
  EXPECT_EQ(refused.exception, 2);
}

// The CRC is linear: a pattern of flipped bits passes when the syndromes of its bits add to zero. Bits of the CRC itself included.
std::vector<std::uint16_t> syndromes(std::size_t bytes) {
  std::vector<std::uint16_t> all;
  const Bytes zero(bytes - 2, 0);
  const std::uint16_t base = crc16(zero);
  for (std::size_t bit = 0; bit < 8 * (bytes - 2); ++bit) {
    Bytes flipped = zero;
    flipped[bit / 8] = static_cast<std::uint8_t>(1u << (bit % 8));
    all.push_back(static_cast<std::uint16_t>(crc16(flipped) ^ base));
  }
  for (int bit = 0; bit < 16; ++bit) all.push_back(static_cast<std::uint16_t>(1u << bit));
  return all;
}

TEST(ModbusFrame, EveryPatternOfOneTwoOrThreeFlippedBitsIsDetectedUpTo256Bytes) {
  const auto s = syndromes(kMaxRtuFrame);
  std::vector<bool> single(65536, false);
  for (const std::uint16_t one : s) {
    ASSERT_NE(one, 0);
    ASSERT_FALSE(single[one]) << "two flipped bits cancel";
    single[one] = true;
  }
  for (std::size_t i = 0; i < s.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) ASSERT_FALSE(single[s[i] ^ s[k]]) << "three flipped bits cancel";
}

// Patterns of four bits that pass, of all there are: what remains of the CRC's protection when lines are worse than assumed.
std::uint64_t undetected_fours(std::size_t bytes) {
  const auto s = syndromes(bytes);
  std::vector<std::uint32_t> pairs(65536, 0);
  for (std::size_t i = 0; i < s.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) ++pairs[s[i] ^ s[k]];
  std::uint64_t pairs_of_pairs = 0;
  for (const std::uint64_t n : pairs) pairs_of_pairs += n * (n - (n > 0)) / 2;
  return pairs_of_pairs / 3;  // each four is found as three pairs of pairs
}

TEST(ModbusFrame, HammingDistanceIsExactly4AndOnePatternOf6400WithFourFlipsPassesIn21Bytes) {
  // 8 bytes one by one, which shows that the count by pairs is right
  const auto s = syndromes(8);
  std::uint64_t passing = 0;
  for (std::size_t a = 0; a < s.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      for (std::size_t c = 0; c < b; ++c)
        for (std::size_t d = 0; d < c; ++d) passing += (s[a] ^ s[b] ^ s[c] ^ s[d]) == 0;
  EXPECT_EQ(passing, undetected_fours(8));
  EXPECT_GT(passing, 0u);
  const double fours = 168.0 * 167.0 * 166.0 * 165.0 / 24.0;  // of the answer with eight registers
  EXPECT_NEAR(fours / static_cast<double>(undetected_fours(21)), 6400.0,
              50.0);  // the polynomial has only four terms: worse than the 2^15 of a good one
}

}  // namespace
}  // namespace rotorloop::modbus
