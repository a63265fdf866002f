// Data types to bytes and transfers to frames.
#include "protocols/transfer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "protocols/types.hpp"
#include "test/unit/protocols/hex.hpp"

namespace rotorloop::protocols {
namespace {

template <class T>
std::string payload_of(const T& value) {
  std::array<std::uint8_t, 400> out{};
  return hex(std::span<const std::uint8_t>(out.data(), encode(value, out)));
}

template <class T>
T back(const T& value) {
  std::array<std::uint8_t, 400> out{};
  T result;
  EXPECT_TRUE(decode(std::span<const std::uint8_t>(out.data(), encode(value, out)), result));
  return result;
}

std::vector<CanFrame> frames_of(const FrameId& id, std::uint16_t seed, std::uint8_t transfer_id, std::span<const std::uint8_t> payload) {
  std::vector<CanFrame> frames;
  EXPECT_TRUE(encode_transfer(id, seed, transfer_id, payload, [&](const CanFrame& f) {
    frames.push_back(f);
    return true;
  }));
  return frames;
}

TEST(FrameIdentifier, MessageAndServiceFieldsStandWhereTheSpecificationPutsThem) {
  EXPECT_EQ(encode_id({.kind = TransferKind::message, .priority = 7, .data_type_id = 1030, .source = 10}), 7u << 24 | 1030u << 8 | 10u);
  EXPECT_EQ(encode_id({.kind = TransferKind::request, .priority = 30, .data_type_id = 1, .source = 127, .destination = 42}), 0x1E01AAFFu);
  EXPECT_EQ(encode_id({.kind = TransferKind::response, .priority = 30, .data_type_id = 1, .source = 42, .destination = 127}), 0x1E017FAAu);
}

TEST(FrameIdentifier, EveryIdentifierDecodesToFieldsThatEncodeToItAgain) {
  for (std::uint32_t i = 0; i < 200000; ++i) {
    const std::uint32_t id = i * 2654435761u & 0x1FFFFFFFu;
    const FrameId f = decode_id(id);
    EXPECT_EQ(encode_id(f), id);
  }
}

TEST(FrameIdentifier, AnonymousMessageKeepsOnlyTwoBitsOfItsType) {
  const FrameId f = decode_id(30u << 24 | 0x2ABCu << 10 | 1u << 8);
  EXPECT_EQ(f.source, kNoNode);
  EXPECT_EQ(f.data_type_id, 1);
}

TEST(DataTypes, GoldenBytesOfRawCommandRpmCommandAndNodeStatus) {
  EXPECT_EQ(payload_of(RawCommand{.command = {0, 8191, -8192, 4096}, .count = 4}), "0003fdf0080010");
  EXPECT_EQ(payload_of(RpmCommand{.rpm = {131071, -131072, 0}, .count = 3}), "ffff4000200000");
  EXPECT_EQ(payload_of(NodeStatus{
                .uptime_s = 1234567, .health = Health::ok, .mode = NodeMode::initialization, .sub_mode = 0, .vendor_status = 0xBEEF}),
            "87d6120008efbe");
}

TEST(DataTypes, ItemCountFollowsFromTheLengthForAllArraySizes) {
  for (std::uint8_t n = 0; n <= 20; ++n) {
    RawCommand raw{.command = {}, .count = n};
    RpmCommand rpm{.rpm = {}, .count = n};
    for (std::size_t i = 0; i < n; ++i) {
      raw.command[i] = static_cast<std::int16_t>(-8192 + 819 * static_cast<int>(i));
      rpm.rpm[i] = 131071 - 13107 * static_cast<int>(i);
    }
    EXPECT_EQ(back(raw).command, raw.command);
    EXPECT_EQ(back(raw).count, n);
    EXPECT_EQ(back(rpm).rpm, rpm.rpm);
    EXPECT_EQ(back(rpm).count, n);
  }
}

TEST(DataTypes, CommandsBeyondFullScaleSaturateInTheEncoder) {
  EXPECT_EQ(back(RawCommand{.command = {32767, -32768}, .count = 2}).command[0], 8191);
  EXPECT_EQ(back(RawCommand{.command = {32767, -32768}, .count = 2}).command[1], -8192);
  EXPECT_EQ(back(RpmCommand{.rpm = {1'000'000, -1'000'000}, .count = 2}).rpm[1], -131072);
}

TEST(DataTypes, EscStatusCarriesKelvinSignedSpeedAndUnknownAsNaN) {
  const EscStatus s{.error_count = 0xDEADBEEF,
                    .voltage_V = 16.0f,
                    .current_A = -3.5f,
                    .temperature_K = std::numeric_limits<float>::quiet_NaN(),
                    .rpm = -17000,
                    .power_rating_pct = 101,
                    .esc_index = 31};
  EXPECT_EQ(payload_of(s).size(), 28u);
  const EscStatus b = back(s);
  EXPECT_EQ(b.error_count, 0xDEADBEEF);
  EXPECT_EQ(b.voltage_V, 16.0f);
  EXPECT_EQ(b.current_A, -3.5f);
  EXPECT_TRUE(std::isnan(b.temperature_K));
  EXPECT_EQ(b.rpm, -17000);
  EXPECT_EQ(b.power_rating_pct, 101);
  EXPECT_EQ(b.esc_index, 31);
}

TEST(DataTypes, GetNodeInfoResponseOfTheLongestNameAndItsCertificateSurvive) {
  GetNodeInfoResponse r{.status = {.uptime_s = 7, .health = Health::warning},
                        .software_major = 1,
                        .software_minor = 2,
                        .software_flags = 3,
                        .vcs_commit = 0x01020304,
                        .image_crc = 0x1122334455667788,
                        .hardware_major = 5,
                        .hardware_minor = 6};
  for (std::uint8_t i = 0; i < 16; ++i) r.unique_id[i] = static_cast<std::uint8_t>(i + 1);
  r.set_name(std::string(100, 'x').c_str());
  EXPECT_EQ(r.name_length, 80);
  EXPECT_EQ(back(r), r);

  std::array<std::uint8_t, 400> out{};
  r.set_name("org.rotorloop.esc");
  const std::size_t size = encode(r, out);
  ASSERT_EQ(size, 41u + 17u);
  std::vector<std::uint8_t> with_certificate(out.begin(), out.begin() + 40);
  with_certificate.push_back(3);
  with_certificate.insert(with_certificate.end(), {0xAA, 0xBB, 0xCC});
  with_certificate.insert(with_certificate.end(), out.begin() + 41, out.begin() + static_cast<std::ptrdiff_t>(size));
  GetNodeInfoResponse b;
  ASSERT_TRUE(decode(with_certificate, b));
  r.certificate.assign(std::array<std::uint8_t, 3>{0xAA, 0xBB, 0xCC});
  EXPECT_EQ(b, r);
  EXPECT_EQ(back(r), r);
}

TEST(DataTypes, PayloadTooShortForItsFieldsIsRefused) {
  const std::array<std::uint8_t, 400> zeros{};
  NodeStatus n;
  EscStatus e;
  ArmingStatus a;
  GetNodeInfoResponse g;
  EXPECT_FALSE(decode(std::span(zeros).first(6), n));
  EXPECT_TRUE(decode(std::span(zeros).first(7), n));
  EXPECT_FALSE(decode(std::span(zeros).first(13), e));
  EXPECT_FALSE(decode(std::span(zeros).first(0), a));
  EXPECT_FALSE(decode(std::span(zeros).first(40), g));
}

TEST(Transfer, SevenBytesFitOneFrameAndEightTakeTwoWithTheCrcInFront) {
  const std::array<std::uint8_t, 8> payload{1, 2, 3, 4, 5, 6, 7, 8};
  const FrameId id{.kind = TransferKind::message, .priority = 16, .data_type_id = 1034, .source = 3};
  const auto one = frames_of(id, 0x1591, 9, std::span(payload).first(7));
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(candump(one[0]), "10040a03#01020304050607c9");
  const auto two = frames_of(id, 0x1591, 9, payload);
  ASSERT_EQ(two.size(), 2u);
  const std::uint16_t crc = crc16(0x1591, payload);
  EXPECT_EQ(two[0].data[0], crc & 0xFF);
  EXPECT_EQ(two[0].data[1], crc >> 8);
  EXPECT_EQ(hex(std::span<const std::uint8_t>(two[0].data).subspan(2)), "010203040589");         // start, toggle 0
  EXPECT_EQ(hex(std::span<const std::uint8_t>(two[1].data.data(), two[1].length)), "06070869");  // end, toggle 1
}

TEST(Transfer, FrameCountIsThatOfTheFormulaForAllLengths) {
  std::array<std::uint8_t, 400> payload{};
  for (std::size_t n = 0; n <= payload.size(); ++n) {
    const auto frames = frames_of({.source = 1}, 0, 0, std::span<const std::uint8_t>(payload).first(n));
    ASSERT_EQ(frames.size(), transfer_frames(static_cast<std::uint32_t>(n))) << n;
    std::uint32_t bits = 0;
    for (const CanFrame& f : frames) bits += worst_frame_bits(true, f.length);
    EXPECT_EQ(bits, worst_transfer_bits(static_cast<std::uint32_t>(n))) << n;
    for (std::size_t i = 0; i + 1 < frames.size(); ++i) EXPECT_EQ(frames[i].length, 8);
  }
  EXPECT_EQ(transfer_frames(14), 3u);
  EXPECT_EQ(transfer_frames(258), 38u);
}

TEST(Transfer, RefusingSinkEndsTheTransferAtOnce) {
  const std::array<std::uint8_t, 30> payload{};
  int offered = 0;
  EXPECT_FALSE(encode_transfer({.source = 1}, 0, 0, payload, [&](const CanFrame&) { return ++offered < 2; }));
  EXPECT_EQ(offered, 2);
}

}  // namespace
}  // namespace rotorloop::protocols
