// The signatures and CRC seeds of the data types, recomputed from the definitions of their fields: a wrong field, order or
// cast changes the signature, and peers would drop our multi-frame transfers.
#include <gtest/gtest.h>

#include <string_view>
#include <vector>

#include "protocols/crc.hpp"
#include "protocols/types.hpp"

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

TEST(DataTypes, SignaturesFollowFromTheFieldDefinitions) {
  EXPECT_EQ(NodeStatus::kType.signature, signature(kNodeStatus));
  EXPECT_EQ(GetNodeInfo::kType.signature, signature(kGetNodeInfo, {signature(kNodeStatus), signature(kSoftware), signature(kHardware)}));
  EXPECT_EQ(RawCommand::kType.signature, signature("uavcan.equipment.esc.RawCommand\nsaturated int14[<=20] cmd"));
  EXPECT_EQ(RpmCommand::kType.signature, signature("uavcan.equipment.esc.RPMCommand\nsaturated int18[<=20] rpm"));
  EXPECT_EQ(EscStatus::kType.signature,
            signature("uavcan.equipment.esc.Status\nsaturated uint32 error_count\nsaturated float16 voltage\nsaturated float16 current\n"
                      "saturated float16 temperature\nsaturated int18 rpm\nsaturated uint7 power_rating_pct\nsaturated uint5 esc_index"));
  EXPECT_EQ(ArmingStatus::kType.signature, signature("uavcan.equipment.safety.ArmingStatus\nsaturated uint8 status"));
}

TEST(DataTypes, CrcSeedsFollowFromTheSignatures) {
  struct Row {
    DataType type;
    std::uint16_t seed;  // as published
  };
  for (const Row& row : {Row{NodeStatus::kType, 0xBE5F}, Row{GetNodeInfo::kType, 0xD9A7}, Row{RawCommand::kType, 0xE4B8},
                         Row{RpmCommand::kType, 0xF8B4}, Row{EscStatus::kType, 0x1591}, Row{ArmingStatus::kType, 0x1890}}) {
    EXPECT_EQ(row.type.crc_seed(), row.seed) << row.type.id;
    EXPECT_EQ(row.type.crc_seed(), crc16_bitwise(row.type.signature)) << row.type.id;
  }
}

}  // namespace
}  // namespace rotorloop::protocols
