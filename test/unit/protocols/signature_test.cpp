// The signatures and CRC seeds of the data types: computed from the same description that encodes them, compared with the published
// values, and for three types recomputed from normalised definitions in text by code that shares nothing with the library.
#include "protocols/signature.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/crc.hpp"
#include "protocols/types/registry.hpp"

namespace rotorloop::protocols {
namespace {

// CRC-64-WE, bit by bit on purpose: shares nothing with the code under test.
std::uint64_t crc64(std::uint64_t extend_from, std::string_view bytes) {
  std::uint64_t crc = ~extend_from;
  for (const char c : bytes) {
    crc ^= static_cast<std::uint64_t>(static_cast<unsigned char>(c)) << 56;
    for (int i = 0; i < 8; ++i) crc = (crc >> 63) != 0 ? crc << 1 ^ 0x42F0E1EBA9EA3693u : crc << 1;
  }
  return ~crc;
}

std::string_view little_endian(const std::uint64_t& value) { return {reinterpret_cast<const char*>(&value), 8}; }

// Signature of a normalised definition, extended by the signatures of its nested types in order.
std::uint64_t signature(std::string_view definition, const std::vector<std::uint64_t>& nested = {}) {
  std::uint64_t s = crc64(0, definition);
  for (const std::uint64_t& n : nested) {
    const std::uint64_t before = s;
    s = crc64(s, little_endian(n));
    s = crc64(s, little_endian(before));
  }
  return s;
}

std::uint16_t crc16_bitwise(std::uint64_t value) {
  std::uint32_t crc = 0xFFFF;
  for (int i = 0; i < 64; ++i) {
    const auto bit = static_cast<std::uint32_t>(value >> (8 * (i / 8) + 7 - i % 8) & 1u);
    const std::uint32_t top = (crc >> 15 & 1u) ^ bit;
    crc = (crc << 1 & 0xFFFFu) ^ (top != 0 ? 0x1021u : 0u);
  }
  return static_cast<std::uint16_t>(crc);
}

TEST(TransferCrc, CheckValuesOfTheAlgorithms) {
  const std::string_view digits = "123456789";
  std::uint16_t crc = kCrc16Start;
  for (const char c : digits) crc = crc16(crc, static_cast<std::uint8_t>(c));
  EXPECT_EQ(crc, 0x29B1);
  EXPECT_EQ(crc64(0, digits), 0x62EC59E3F1A4F00Au);
  Crc64 ours;
  ours.add_text("123456789");
  EXPECT_EQ(ours.value(), 0x62EC59E3F1A4F00Au);
}

constexpr std::string_view kNodeStatus =
    "uavcan.protocol.NodeStatus\nsaturated uint32 uptime_sec\nsaturated uint2 health\nsaturated uint3 mode\n"
    "saturated uint3 sub_mode\nsaturated uint16 vendor_specific_status_code";
constexpr std::string_view kSoftware =
    "uavcan.protocol.SoftwareVersion\nsaturated uint8 major\nsaturated uint8 minor\nsaturated uint8 optional_field_flags\n"
    "saturated uint32 vcs_commit\nsaturated uint64 image_crc";
constexpr std::string_view kHardware =
    "uavcan.protocol.HardwareVersion\nsaturated uint8 major\nsaturated uint8 minor\nsaturated uint8[16] unique_id\n"
    "saturated uint8[<=255] certificate_of_authenticity";
constexpr std::string_view kGetNodeInfo =
    "uavcan.protocol.GetNodeInfo\n---\nuavcan.protocol.NodeStatus status\nuavcan.protocol.SoftwareVersion software_version\n"
    "uavcan.protocol.HardwareVersion hardware_version\nsaturated uint8[<=80] name";

// As published with the definitions (DroneCAN DSDL), and the CRC of the signature that every implementation starts from.
struct Published {
  DataType type;
  std::uint16_t id;
  std::uint64_t signature;
  std::uint16_t seed;
};
constexpr Published kPublished[] = {
    {NodeStatus::kType, 341, 0x0F0868D0C1A7C6F1, 0xBE5F},
    {GetNodeInfo::kType, 1, 0xEE468A8121C46A9E, 0xD9A7},
    {GetDataTypeInfo::kType, 2, 0x1B283338A7BED2D8, 0x17F9},
    {GetTransportStats::kType, 4, 0xBE6F76A7EC312B04, 0x4D73},
    {RestartNode::kType, 5, 0x569E05394A3017F0, 0x1F7F},
    {GlobalTimeSync::kType, 4, 0x20271116A793C2DB, 0x7908},
    {Panic::kType, 5, 0x8B79B4101811C1D7, 0xFC5E},
    {Allocation::kType, 1, 0x0B2A812620A11D40, 0xF258},
    {ParamExecuteOpcode::kType, 10, 0x3B131AC5EB69D2CD, 0xD7D4},
    {ParamGetSet::kType, 11, 0xA7B622F939D1A4D5, 0xFB10},
    {EnumerationBegin::kType, 15, 0x196AE06426A3B5D8, 0x2CC0},
    {EnumerationIndication::kType, 380, 0x884CB63050A84F35, 0xA996},
    {BeginFirmwareUpdate::kType, 40, 0xB7D725DF72724126, 0x729E},
    {FileGetInfo::kType, 45, 0x5004891EE8A27531, 0x14B9},
    {GetDirectoryEntryInfo::kType, 46, 0x8C46E8AB568BDA79, 0xAFB9},
    {FileDelete::kType, 47, 0x78648C99170B47AA, 0x018D},
    {FileRead::kType, 48, 0x8DCDCA939F33F678, 0x2F12},
    {FileWrite::kType, 49, 0x515AA1DC77E58429, 0x0D36},
    {KeyValue::kType, 16370, 0xE02F25D6E0C98AE0, 0xDD34},
    {LogMessage::kType, 16383, 0xD654A48E0C049D75, 0x4570},
    {FlexDebug::kType, 16371, 0xECA60382FF038F39, 0x79CE},
    {NodeStats::kType, 342, 0x763AE3B8A986F8D1, 0x5E98},
    {CanStats::kType, 343, 0xCE080CAE3CA33C75, 0xE601},
    {GlobalTime::kType, 344, 0xA55177448A490F33, 0x52C6},
    {RawCommand::kType, 1030, 0x217F5C87D7EC951D, 0xE4B8},
    {RpmCommand::kType, 1031, 0xCE0F9F621CF7E70B, 0xF8B4},
    {EscStatus::kType, 1034, 0xA9AF28AEA2FBB254, 0x1591},
    {EscStatusExtended::kType, 1036, 0x02DC203C50960EDC, 0xE786},
    {RpmSensor::kType, 1045, 0x140707C09274F6E7, 0xD480},
    {ArmingStatus::kType, 1100, 0x8700F375556A8003, 0x1890},
    {SafetyState::kType, 20000, 0xE965701A95A1A6A1, 0x06A7},
    {BeepCommand::kType, 1080, 0xBE9EA9FEC2B15D52, 0xDFBD},
    {LightsCommand::kType, 1081, 0x2031D93C8BDD1EC4, 0x9E31},
    {RawImu::kType, 1003, 0x8280632C40E574B5, 0x4E3E},
    {GnssFix::kType, 1060, 0x54C1572B9E07F297, 0x9510},
    {GnssFix2::kType, 1063, 0xCA41E7000F37435F, 0xC798},
    {GnssAuxiliary::kType, 1061, 0x9BE8BDC4C3DBBFD2, 0x24AE},
    {CircuitStatus::kType, 1091, 0x8313D33D0DDDA115, 0x2CB7},
    {BatteryInfo::kType, 1092, 0x249C26548A711966, 0xF674},
    {DeviceTemperature::kType, 1110, 0x70261C28A94144C6, 0x5D7E},
    {ActuatorArrayCommand::kType, 1010, 0xD8A7486238EC3AF3, 0x5E37},
    {ActuatorStatus::kType, 1011, 0x5E9BBA44FAF1EA04, 0x9A63},
    {TunnelBroadcast::kType, 2010, 0x5AA2D4D9CF4B1E85, 0x1C82},
    {TunnelTargetted::kType, 3001, 0xB138E7EA72A2A2E9, 0x7CA9},
    {TunnelCall::kType, 63, 0xDB11EDC510502658, 0xF848},
};

TEST(DataTypes, SignaturesComputedFromTheDescriptionsEqualThePublishedOnesAndNoTypeIsLeftOut) {
  std::map<std::uint64_t, Published> published;
  for (const Published& row : kPublished) {
    published[row.signature] = row;
    EXPECT_EQ(row.type.id, row.id);
    EXPECT_EQ(row.type.signature, row.signature) << row.id;
  }
  std::size_t types = 0;
  const auto check = [&](const char* name, const DataType& type, std::uint64_t computed) {
    ++types;
    EXPECT_EQ(computed, type.signature) << name;
    ASSERT_TRUE(published.contains(computed)) << name;
    EXPECT_EQ(published[computed].id, type.id) << name;
  };
  for_each_message([&]<class T>() {
    EXPECT_FALSE(T::kType.service) << T::kName;
    check(T::kName, T::kType, signature_of<T>());
  });
  for_each_service([&]<class Request, class Response>() {
    EXPECT_TRUE(Request::kType.service) << Request::kName;
    EXPECT_EQ(Response::kType.id, Request::kType.id);
    EXPECT_STREQ(Response::kName, Request::kName);
    check(Request::kName, Request::kType, signature_of_service<Request, Response>());
  });
  EXPECT_EQ(types, std::size(kPublished));
}

TEST(DataTypes, SignaturesRecomputedFromDefinitionsInText) {
  EXPECT_EQ(NodeStatus::kType.signature, signature(kNodeStatus));
  EXPECT_EQ(GetNodeInfo::kType.signature, signature(kGetNodeInfo, {signature(kNodeStatus), signature(kSoftware), signature(kHardware)}));
  EXPECT_EQ(EscStatus::kType.signature,
            signature("uavcan.equipment.esc.Status\nsaturated uint32 error_count\nsaturated float16 voltage\nsaturated float16 current\n"
                      "saturated float16 temperature\nsaturated int18 rpm\nsaturated uint7 power_rating_pct\nsaturated uint5 esc_index"));
}

TEST(DataTypes, CrcSeedsEqualThePublishedOnes) {
  for (const Published& row : kPublished) {
    EXPECT_EQ(row.type.crc_seed(), row.seed) << row.id;
    EXPECT_EQ(row.seed, crc16_bitwise(row.signature)) << row.id;
  }
}

TEST(DataTypes, LargestPayloadsAreThoseOfThePublishedDefinitionsWithoutTailArrayOptimisation) {
  EXPECT_EQ(max_bytes<NodeStatus>(), 7u);
  EXPECT_EQ(max_bytes<RawCommand>(), 36u);            // 285 bits
  EXPECT_EQ(max_bytes<RpmCommand>(), 46u);            // 365
  EXPECT_EQ(max_bytes<GetNodeInfoResponse>(), 377u);  // 3015
  EXPECT_EQ(max_bytes<ParamGetSet>(), 224u);          // 1791
  EXPECT_EQ(max_bytes<ParamGetSetResponse>(), 371u);  // 2967
  EXPECT_EQ(max_bytes<FileReadResponse>(), 260u);     // 2073
  EXPECT_EQ(max_bytes<FileWrite>(), 399u);            // 3192
  EXPECT_EQ(max_bytes<LightsCommand>(), 61u);         // 485
  EXPECT_EQ(max_bytes<GnssFix2>(), 222u);             // 1769
}

}  // namespace
}  // namespace rotorloop::protocols
