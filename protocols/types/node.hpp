// What every node says of itself: NodeStatus, identity, restart, time (docs/wire.md §2).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocols/dsdl.hpp"
#include "protocols/transfer.hpp"

namespace rotorloop::protocols {

enum class Health : std::uint8_t { ok, warning, error, critical };
enum class NodeMode : std::uint8_t { operational = 0, initialization = 1, maintenance = 2, software_update = 3, offline = 7 };

struct NodeStatus {
  static constexpr DataType kType{.service = false, .id = 341, .signature = 0x0F0868D0C1A7C6F1};
  static constexpr const char* kName = "uavcan.protocol.NodeStatus";
  static constexpr std::size_t kMaxBytes = 7;
  std::uint32_t uptime_s = 0;
  Health health = Health::ok;
  NodeMode mode = NodeMode::operational;
  std::uint8_t sub_mode = 0;
  std::uint16_t vendor_status = 0;
  friend constexpr bool operator==(const NodeStatus&, const NodeStatus&) = default;

  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("uptime_sec", u(32), v.uptime_s);
    f.value("health", u(2), v.health);
    f.value("mode", u(3), v.mode);
    f.value("sub_mode", u(3), v.sub_mode);
    f.value("vendor_specific_status_code", u(16), v.vendor_status);
  }
};

// The request is empty.
struct GetNodeInfo {
  static constexpr DataType kType{.service = true, .id = 1, .signature = 0xEE468A8121C46A9E};
  static constexpr const char* kName = "uavcan.protocol.GetNodeInfo";
  template <class F, class Self>
  static constexpr void describe(F&, Self&) {}
};

struct GetNodeInfoResponse {
  static constexpr DataType kType = GetNodeInfo::kType;
  static constexpr const char* kName = GetNodeInfo::kName;
  static constexpr std::size_t kMaxName = 80;
  static constexpr std::size_t kMaxBytes = 7 + 15 + 2 + 16 + 1 + 255 + kMaxName;  // 376
  static constexpr std::uint8_t kHasCommit = 1, kHasImageCrc = 2;
  NodeStatus status{};
  std::uint8_t software_major = 0, software_minor = 0;
  std::uint8_t software_flags = 0;  // kHasCommit: vcs_commit is valid, kHasImageCrc: image_crc is valid
  std::uint32_t vcs_commit = 0;
  std::uint64_t image_crc = 0;
  std::uint8_t hardware_major = 0, hardware_minor = 0;
  std::array<std::uint8_t, 16> unique_id{};
  BoundedArray<std::uint8_t, 255> certificate{};  // of authenticity: what the maker signed the unique id with
  std::array<char, kMaxName> name{};              // a-z 0-9 . - _, reversed domain; not terminated
  std::uint8_t name_length = 0;
  friend constexpr bool operator==(const GetNodeInfoResponse&, const GetNodeInfoResponse&) = default;

  // Takes at most 80 characters.
  constexpr void set_name(const char* text) {
    name = {};
    name_length = 0;
    add_to_name(text);
  }
  constexpr void add_to_name(const char* text) {
    for (; name_length < kMaxName && *text != '\0'; ++text) name[name_length++] = *text;
  }

  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested("status", v.status);
    f.group("uavcan.protocol.SoftwareVersion", "software_version", [&](auto& g) {
      g.value("major", u(8), v.software_major);
      g.value("minor", u(8), v.software_minor);
      g.value("optional_field_flags", u(8), v.software_flags);
      g.value("vcs_commit", u(32), v.vcs_commit);
      g.value("image_crc", u(64), v.image_crc);
    });
    f.group("uavcan.protocol.HardwareVersion", "hardware_version", [&](auto& g) {
      g.value("major", u(8), v.hardware_major);
      g.value("minor", u(8), v.hardware_minor);
      g.fixed("unique_id", u(8), v.unique_id);
      g.items("certificate_of_authenticity", u(8), v.certificate.items, v.certificate.count);
    });
    f.tail("name", u(8), v.name, v.name_length);
  }
};

struct RestartNode {
  static constexpr DataType kType{.service = true, .id = 5, .signature = 0x569E05394A3017F0};
  static constexpr const char* kName = "uavcan.protocol.RestartNode";
  static constexpr std::uint64_t kMagic = 0xACCE551B1E;  // any other number is refused
  std::uint64_t magic = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("magic_number", u(40), v.magic);
  }
};

struct RestartNodeResponse {
  static constexpr DataType kType = RestartNode::kType;
  static constexpr const char* kName = RestartNode::kName;
  bool ok = false;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("ok", kBool, v.ok);
  }
};

// Sent by the time master every 40..1100 ms; of several the one with the lowest node id counts. The time is that of the message
// before, so that a master can take the stamp when its frame has left.
struct GlobalTimeSync {
  static constexpr DataType kType{.service = false, .id = 4, .signature = 0x20271116A793C2DB};
  static constexpr const char* kName = "uavcan.protocol.GlobalTimeSync";
  std::uint64_t previous_us = 0;  // 56 bits; 0: not known
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("previous_transmission_timestamp_usec", truncated_u(56), v.previous_us);
  }
};

struct Panic {
  static constexpr DataType kType{.service = false, .id = 5, .signature = 0x8B79B4101811C1D7};
  static constexpr const char* kName = "uavcan.protocol.Panic";
  Text<7> reason{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.tail("reason_text", u(8), v.reason.items, v.reason.count);
  }
};

struct GetDataTypeInfo {
  static constexpr DataType kType{.service = true, .id = 2, .signature = 0x1B283338A7BED2D8};
  static constexpr const char* kName = "uavcan.protocol.GetDataTypeInfo";
  std::uint16_t id = 0;
  std::uint8_t kind = 0;  // 0 service, 1 message
  Text<80> name{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("id", u(16), v.id);
    f.group("uavcan.protocol.DataTypeKind", "kind", [&](auto& g) { g.value("value", u(8), v.kind); });
    f.tail("name", u(8), v.name.items, v.name.count);
  }
};

struct GetDataTypeInfoResponse {
  static constexpr DataType kType = GetDataTypeInfo::kType;
  static constexpr const char* kName = GetDataTypeInfo::kName;
  std::uint64_t signature = 0;
  std::uint16_t id = 0;
  std::uint8_t kind = 0;
  std::uint8_t flags = 0;  // 1 known, 2 subscribed, 4 publishing, 8 serving
  Text<80> name{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("signature", u(64), v.signature);
    f.value("id", u(16), v.id);
    f.group("uavcan.protocol.DataTypeKind", "kind", [&](auto& g) { g.value("value", u(8), v.kind); });
    f.value("flags", u(8), v.flags);
    f.tail("name", u(8), v.name.items, v.name.count);
  }
};

struct GetTransportStats {
  static constexpr DataType kType{.service = true, .id = 4, .signature = 0xBE6F76A7EC312B04};
  static constexpr const char* kName = "uavcan.protocol.GetTransportStats";
  template <class F, class Self>
  static constexpr void describe(F&, Self&) {}
};

struct CanInterfaceStats {
  static constexpr const char* kName = "uavcan.protocol.CANIfaceStats";
  std::uint64_t frames_tx = 0, frames_rx = 0, errors = 0;
  friend constexpr bool operator==(const CanInterfaceStats&, const CanInterfaceStats&) = default;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("frames_tx", u(48), v.frames_tx);
    f.value("frames_rx", u(48), v.frames_rx);
    f.value("errors", u(48), v.errors);
  }
};

struct GetTransportStatsResponse {
  static constexpr DataType kType = GetTransportStats::kType;
  static constexpr const char* kName = GetTransportStats::kName;
  std::uint64_t transfers_tx = 0, transfers_rx = 0, transfer_errors = 0;
  BoundedArray<CanInterfaceStats, 3> interfaces{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("transfers_tx", u(48), v.transfers_tx);
    f.value("transfers_rx", u(48), v.transfers_rx);
    f.value("transfer_errors", u(48), v.transfer_errors);
    f.structs_tail("can_iface_stats", v.interfaces.items, v.interfaces.count);
  }
};

}  // namespace rotorloop::protocols
