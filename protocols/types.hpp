// The DroneCAN data types that the toolkit speaks: fields, ids, signatures (docs/wire.md §2). Source: public DSDL definitions of
// DroneCAN; the unit test recomputes each signature from the normalised definition. encode() saturates, writes from the
// start of `out` and returns the payload size (0 bytes is a valid size of some types; all fit into k...MaxBytes). decode() is
// false when the payload is too short for the fixed fields; longer payloads are accepted.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocols/bits.hpp"
#include "protocols/transfer.hpp"

namespace rotorloop::protocols {

enum class Health : std::uint8_t { ok, warning, error, critical };
enum class NodeMode : std::uint8_t { operational = 0, initialization = 1, maintenance = 2, software_update = 3, offline = 7 };

struct NodeStatus {
  static constexpr DataType kType{.service = false, .id = 341, .signature = 0x0F0868D0C1A7C6F1};
  static constexpr std::size_t kMaxBytes = 7;
  std::uint32_t uptime_s = 0;
  Health health = Health::ok;
  NodeMode mode = NodeMode::operational;
  std::uint8_t sub_mode = 0;
  std::uint16_t vendor_status = 0;
  friend constexpr bool operator==(const NodeStatus&, const NodeStatus&) = default;

  constexpr void write(BitWriter& w) const {
    w.put(uptime_s, 32);
    w.put_saturated(static_cast<std::uint32_t>(health), 2);
    w.put_saturated(static_cast<std::uint32_t>(mode), 3);
    w.put_saturated(sub_mode, 3);
    w.put(vendor_status, 16);
  }
  constexpr void read(BitReader& r) {
    uptime_s = r.get_as<std::uint32_t>(32);
    health = r.get_as<Health>(2);
    mode = r.get_as<NodeMode>(3);
    sub_mode = r.get_as<std::uint8_t>(3);
    vendor_status = r.get_as<std::uint16_t>(16);
  }
};

// The request is empty.
struct GetNodeInfo {
  static constexpr DataType kType{.service = true, .id = 1, .signature = 0xEE468A8121C46A9E};
};

struct GetNodeInfoResponse {
  static constexpr DataType kType = GetNodeInfo::kType;
  static constexpr std::size_t kMaxName = 80;
  static constexpr std::size_t kMaxBytes = 7 + 15 + 2 + 16 + 1 + 255 + kMaxName;  // 376
  NodeStatus status;
  std::uint8_t software_major = 0, software_minor = 0;
  std::uint8_t software_flags = 0;  // 1: vcs_commit is valid, 2: image_crc is valid
  std::uint32_t vcs_commit = 0;
  std::uint64_t image_crc = 0;
  std::uint8_t hardware_major = 0, hardware_minor = 0;
  std::array<std::uint8_t, 16> unique_id{};
  std::array<char, kMaxName> name{};  // a-z 0-9 . - _, reversed domain; not terminated
  std::uint8_t name_length = 0;
  friend constexpr bool operator==(const GetNodeInfoResponse&, const GetNodeInfoResponse&) = default;

  // Takes at most 80 characters.
  constexpr void set_name(const char* text) {
    name = {};
    name_length = 0;
    while (name_length < kMaxName && text[name_length] != '\0') {
      name[name_length] = text[name_length];
      ++name_length;
    }
  }
};

// Array position = esc_index. Sent with as many items as there are ESCs; four fill exactly one frame.
struct RawCommand {
  static constexpr DataType kType{.service = false, .id = 1030, .signature = 0x217F5C87D7EC951D};
  static constexpr std::size_t kMaxItems = 20, kMaxBytes = 35;
  static constexpr std::int32_t kFullScale = 8191;  // 100 %; -8192..8191 on the wire
  std::array<std::int16_t, kMaxItems> command{};
  std::uint8_t count = 0;
};

struct RpmCommand {
  static constexpr DataType kType{.service = false, .id = 1031, .signature = 0xCE0F9F621CF7E70B};
  static constexpr std::size_t kMaxItems = 20, kMaxBytes = 45;
  std::array<std::int32_t, kMaxItems> rpm{};  // mechanical, ±131071
  std::uint8_t count = 0;
};

struct EscStatus {
  static constexpr DataType kType{.service = false, .id = 1034, .signature = 0xA9AF28AEA2FBB254};
  static constexpr std::size_t kMaxBytes = 14;
  std::uint32_t error_count = 0;
  float voltage_V = 0.0f;
  float current_A = 0.0f;             // negative: regeneration
  float temperature_K = 0.0f;         // NaN: unknown, as for the two above
  std::int32_t rpm = 0;               // mechanical, signed
  std::uint8_t power_rating_pct = 0;  // 0..127
  std::uint8_t esc_index = 0;
};

struct ArmingStatus {
  static constexpr DataType kType{.service = false, .id = 1100, .signature = 0x8700F375556A8003};
  static constexpr std::size_t kMaxBytes = 1;
  static constexpr std::uint8_t kDisarmed = 0, kFullyArmed = 255;
  std::uint8_t status = kDisarmed;
};

constexpr std::size_t encode(const NodeStatus& v, std::span<std::uint8_t> out) {
  BitWriter w(out);
  v.write(w);
  return w.bytes();
}
constexpr bool decode(std::span<const std::uint8_t> in, NodeStatus& v) {
  BitReader r(in);
  v.read(r);
  return !r.missing();
}

// The certificate of authenticity is sent empty.
constexpr std::size_t encode(const GetNodeInfoResponse& v, std::span<std::uint8_t> out) {
  BitWriter w(out);
  v.status.write(w);
  w.put(v.software_major, 8);
  w.put(v.software_minor, 8);
  w.put(v.software_flags, 8);
  w.put(v.vcs_commit, 32);
  w.put(v.image_crc, 64);
  w.put(v.hardware_major, 8);
  w.put(v.hardware_minor, 8);
  w.put_bytes(v.unique_id);
  w.put(0, 8);
  const std::size_t length = std::min<std::size_t>(v.name_length, GetNodeInfoResponse::kMaxName);
  for (std::size_t i = 0; i < length; ++i) w.put(static_cast<std::uint8_t>(v.name[i]), 8);
  return w.bytes();
}
// A certificate is skipped.
constexpr bool decode(std::span<const std::uint8_t> in, GetNodeInfoResponse& v) {
  BitReader r(in);
  v.status.read(r);
  v.software_major = r.get_as<std::uint8_t>(8);
  v.software_minor = r.get_as<std::uint8_t>(8);
  v.software_flags = r.get_as<std::uint8_t>(8);
  v.vcs_commit = r.get_as<std::uint32_t>(32);
  v.image_crc = r.get(64);
  v.hardware_major = r.get_as<std::uint8_t>(8);
  v.hardware_minor = r.get_as<std::uint8_t>(8);
  for (std::uint8_t& b : v.unique_id) b = r.get_as<std::uint8_t>(8);
  for (std::size_t n = r.get_as<std::size_t>(8); n > 0; --n) r.get(8);
  if (r.missing()) return false;
  v.name = {};
  v.name_length = static_cast<std::uint8_t>(std::min(r.remaining_bits() / 8u, GetNodeInfoResponse::kMaxName));
  for (std::size_t i = 0; i < v.name_length; ++i) v.name[i] = r.get_as<char>(8);
  return true;
}

constexpr std::size_t encode(const RawCommand& v, std::span<std::uint8_t> out) {
  BitWriter w(out);
  for (std::size_t i = 0; i < std::min<std::size_t>(v.count, RawCommand::kMaxItems); ++i) w.put_signed_saturated(v.command[i], 14);
  return w.bytes();
}
// The number of items follows from the length (tail array optimisation); bits that fill up the last byte are no item.
constexpr bool decode(std::span<const std::uint8_t> in, RawCommand& v) {
  BitReader r(in);
  v.count = static_cast<std::uint8_t>(std::min(r.remaining_bits() / 14u, RawCommand::kMaxItems));
  for (std::size_t i = 0; i < v.count; ++i) v.command[i] = static_cast<std::int16_t>(r.get_signed(14));
  return true;
}

constexpr std::size_t encode(const RpmCommand& v, std::span<std::uint8_t> out) {
  BitWriter w(out);
  for (std::size_t i = 0; i < std::min<std::size_t>(v.count, RpmCommand::kMaxItems); ++i) w.put_signed_saturated(v.rpm[i], 18);
  return w.bytes();
}
constexpr bool decode(std::span<const std::uint8_t> in, RpmCommand& v) {
  BitReader r(in);
  v.count = static_cast<std::uint8_t>(std::min(r.remaining_bits() / 18u, RpmCommand::kMaxItems));
  for (std::size_t i = 0; i < v.count; ++i) v.rpm[i] = r.get_signed(18);
  return true;
}

constexpr std::size_t encode(const EscStatus& v, std::span<std::uint8_t> out) {
  BitWriter w(out);
  w.put(v.error_count, 32);
  w.put_float16(v.voltage_V);
  w.put_float16(v.current_A);
  w.put_float16(v.temperature_K);
  w.put_signed_saturated(v.rpm, 18);
  w.put_saturated(v.power_rating_pct, 7);
  w.put_saturated(v.esc_index, 5);
  return w.bytes();
}
constexpr bool decode(std::span<const std::uint8_t> in, EscStatus& v) {
  BitReader r(in);
  v.error_count = r.get_as<std::uint32_t>(32);
  v.voltage_V = r.get_float16();
  v.current_A = r.get_float16();
  v.temperature_K = r.get_float16();
  v.rpm = r.get_signed(18);
  v.power_rating_pct = r.get_as<std::uint8_t>(7);
  v.esc_index = r.get_as<std::uint8_t>(5);
  return !r.missing();
}

constexpr std::size_t encode(const ArmingStatus& v, std::span<std::uint8_t> out) {
  BitWriter w(out);
  w.put(v.status, 8);
  return w.bytes();
}
constexpr bool decode(std::span<const std::uint8_t> in, ArmingStatus& v) {
  BitReader r(in);
  v.status = r.get_as<std::uint8_t>(8);
  return !r.missing();
}

}  // namespace rotorloop::protocols
