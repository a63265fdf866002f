// All data types at once, by properties, and the rules of serialisation that single types show: length fields, unions, padding.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "host/base/random.hpp"
#include "protocols/receiver.hpp"
#include "protocols/types/registry.hpp"
#include "test/unit/protocols/hex.hpp"

namespace rotorloop::protocols {
namespace {

template <class T>
std::string payload_hex(const T& value, Framing framing = Framing::classic) {
  std::array<std::uint8_t, 512> out{};
  return hex(std::span<const std::uint8_t>(out.data(), encode(value, out, framing)));
}

// Whatever bytes decode to a value: that value goes out as frames, comes in as a transfer, and is the same again.
template <class T>
void expect_random_values_survive_the_bus(const RandomStream& random, std::uint64_t& n, TransferKind kind) {
  const std::array<Subscription, 1> wanted{subscribe(kind, T::kType)};
  int survived = 0;
  for (int round = 0; round < 200; ++round) {
    const Framing framing = round % 2 == 0 ? Framing::classic : Framing::fd;
    std::array<std::uint8_t, 512> bytes{};
    for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random.bits(n++) >> 56);
    const std::size_t size = random.bits(n++) % (max_bytes<T>() + 1);
    T value;
    if (!decode(std::span<const std::uint8_t>(bytes.data(), size), value, framing)) continue;
    std::array<std::uint8_t, max_bytes<T>() + 1> sent{}, again{};
    const std::size_t sent_size = encode(value, sent, framing);
    Receiver<1, 512> receiver(10, wanted);
    const FrameId id{.kind = kind, .priority = 16, .data_type_id = T::kType.id, .source = 20, .destination = 10};
    const auto on_frame = [&](const auto& f) {
      if (const auto t = receiver.accept(f, 1000)) {
        T back;
        EXPECT_TRUE(decode(t->payload, back, t->framing)) << T::kName;
        EXPECT_EQ(encode(back, again, framing), sent_size) << T::kName;
        ++survived;
      }
      return true;
    };
    const std::span<const std::uint8_t> payload(sent.data(), sent_size);
    const auto transfer_id = static_cast<std::uint8_t>(round % 32);
    if (framing == Framing::classic) {
      encode_transfer(id, T::kType.crc_seed(), transfer_id, payload, on_frame);
    } else {
      encode_transfer_fd(id, T::kType.crc_seed(), transfer_id, payload, on_frame);
    }
    ASSERT_EQ(again, sent) << T::kName;
  }
  EXPECT_GT(survived, 0) << T::kName;
}

TEST(DataTypes, RandomValuesOfEveryTypeSurviveClassicAndFdFramesBitByBit) {
  const RandomStream random(7, 19);
  std::uint64_t n = 0;
  for_each_message([&]<class T>() { expect_random_values_survive_the_bus<T>(random, n, TransferKind::message); });
  for_each_service([&]<class Request, class Response>() {
    expect_random_values_survive_the_bus<Request>(random, n, TransferKind::request);
    expect_random_values_survive_the_bus<Response>(random, n, TransferKind::response);
  });
}

TEST(DataTypes, RandomBytesNeverMakeAnArrayLongerThanItCanBe) {
  const RandomStream random(8, 19);
  std::uint64_t n = 0;
  for (int round = 0; round < 2000; ++round) {
    std::array<std::uint8_t, 400> bytes{};
    for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random.bits(n++) >> 56);
    ParamGetSetResponse p;
    decode(bytes, p, round % 2 == 0 ? Framing::classic : Framing::fd);
    ASSERT_LE(p.name.count, kMaxParameterName);
    ASSERT_LE(p.value.string.count, 128);
    GnssFix2 g;
    decode(bytes, g, round % 2 == 0 ? Framing::classic : Framing::fd);
    ASSERT_LE(g.covariance.count, 36);
    ASSERT_LE(g.ecef.count, 1);
  }
}

TEST(DataTypes, ArrayAtTheEndHasALengthFieldOnCanFdOnly) {
  const RawCommand c{.command = {0, 8191, -8192, 4096}, .count = 4};
  EXPECT_EQ(payload_hex(c), "0003fdf0080010");
  EXPECT_EQ(payload_hex(c, Framing::fd).size(), 2u * 8u);  // 5 + 56 bits
  std::array<std::uint8_t, 8> out{};
  encode(c, out, Framing::fd);
  BitReader r(out);
  EXPECT_EQ(r.get(5), 4u);
  for (const std::int32_t v : {0, 8191, -8192, 4096}) EXPECT_EQ(r.get_signed(14), v);
}

TEST(DataTypes, ArrayThatIsNotTheLastFieldKeepsItsLengthField) {
  const LogMessage m{.level = LogMessage::Level::warning, .source = "esc", .text = "hot"};
  EXPECT_EQ(payload_hex(m), "43657363686f74");  // level 010, length 00011: one byte
  FileWrite w{.offset = 1, .path = "ab", .data = {}};
  w.data.push_back(0xEE);
  EXPECT_EQ(payload_hex(w), "0100000000026162ee");
}

TEST(DataTypes, ParameterValuesAreATagOfThreeBitsAndTheMemberItNames) {
  const ParamGetSet get{.index = 5, .value = {}, .name = {}};
  EXPECT_EQ(payload_hex(get), "0500");  // 13 bits of index, three of tag
  ParamGetSetResponse r{.value = ParamValue::of(1.5f), .default_value = ParamValue::of(true), .name = "x"};
  r.max_value = NumericValue::of(std::int64_t{-1});
  EXPECT_EQ(payload_hex(r), "020000c03f030101ffffffffffffffff0078");
  ParamGetSetResponse back;
  std::array<std::uint8_t, 400> out{};
  ASSERT_TRUE(decode(std::span<const std::uint8_t>(out.data(), encode(r, out)), back));
  EXPECT_EQ(back.value, r.value);
  EXPECT_EQ(back.default_value, r.default_value);
  EXPECT_EQ(back.max_value, r.max_value);
  EXPECT_EQ(back.name, r.name);
  const std::array<std::uint8_t, 2> bad_tag{0x00, 0x07};  // a sixth to eighth member does not exist
  ParamGetSet b;
  EXPECT_FALSE(decode(bad_tag, b));
}

TEST(DataTypes, RestartMagicStandsLowByteFirst) { EXPECT_EQ(payload_hex(RestartNode{.magic = RestartNode::kMagic}), "1e1b55ceac"); }

TEST(DataTypes, TimeOf57BitsIsTruncatedTo56) {
  EXPECT_EQ(payload_hex(GlobalTimeSync{.previous_us = (std::uint64_t{1} << 56) + 0x0102}), "02010000000000");
}

TEST(DataTypes, AngleAndFlagsOfStatusExtendedClampToTheir9And19Bits) {
  const EscStatusExtended s{.input_pct = 200,
                            .output_pct = 50,
                            .motor_temperature_degC = -300,
                            .motor_angle_deg = 600,
                            .status_flags = 0xFFFFFFFF,
                            .esc_index = 3};
  std::array<std::uint8_t, 7> out{};
  EXPECT_EQ(encode(s, out), 7u);
  EscStatusExtended b;
  ASSERT_TRUE(decode(out, b));
  EXPECT_EQ(b.input_pct, 127);
  EXPECT_EQ(b.motor_temperature_degC, -256);
  EXPECT_EQ(b.motor_angle_deg, 511);
  EXPECT_EQ(b.status_flags, 0x7FFFFu);
  EXPECT_EQ(b.esc_index, 3);
}

// The three stages of the allocation, DroneCAN specification "Dynamic node ID allocation": 6, 6 and 4 bytes.
TEST(DataTypes, AllocationRequestOfSixBytesAndTheAnswerWithAllSixteen) {
  Allocation request{.node_id = 0, .first_part = true, .unique_id = {}};
  for (std::uint8_t k = 1; k <= 6; ++k) request.unique_id.push_back(k);
  EXPECT_EQ(payload_hex(request), "01010203040506");
  Allocation answer{.node_id = 125, .first_part = false, .unique_id = {}};
  for (std::uint8_t k = 1; k <= 16; ++k) answer.unique_id.push_back(k);
  EXPECT_EQ(payload_hex(answer), "fa0102030405060708090a0b0c0d0e0f10");
}

}  // namespace
}  // namespace rotorloop::protocols
