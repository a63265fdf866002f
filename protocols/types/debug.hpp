// Messages for people and for statistics (docs/wire.md §2).
#pragma once
#include <cstddef>
#include <cstdint>

#include "protocols/dsdl.hpp"
#include "protocols/transfer.hpp"

namespace rotorloop::protocols {

struct LogMessage {
  static constexpr DataType kType{.service = false, .id = 16383, .signature = 0xD654A48E0C049D75};
  static constexpr const char* kName = "uavcan.protocol.debug.LogMessage";
  enum class Level : std::uint8_t { debug, info, warning, error };
  Level level = Level::debug;
  Text<31> source{};
  Text<90> text{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.group("uavcan.protocol.debug.LogLevel", "level", [&](auto& g) { g.value("value", u(3), v.level); });
    f.items("source", u(8), v.source.items, v.source.count);
    f.tail("text", u(8), v.text.items, v.text.count);
  }
};

struct KeyValue {
  static constexpr DataType kType{.service = false, .id = 16370, .signature = 0xE02F25D6E0C98AE0};
  static constexpr const char* kName = "uavcan.protocol.debug.KeyValue";
  float value = 0.0f;
  Text<58> key{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("value", kFloat32, v.value);
    f.tail("key", u(8), v.key.items, v.key.count);
  }
};

struct FlexDebug {
  static constexpr DataType kType{.service = false, .id = 16371, .signature = 0xECA60382FF038F39};
  static constexpr const char* kName = "dronecan.protocol.FlexDebug";
  std::uint16_t id = 0;
  BoundedArray<std::uint8_t, 255> data{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("id", u(16), v.id);
    f.tail("u8", u(8), v.data.items, v.data.count);
  }
};

struct NodeStats {
  static constexpr DataType kType{.service = false, .id = 342, .signature = 0x763AE3B8A986F8D1};
  static constexpr const char* kName = "dronecan.protocol.Stats";
  std::uint32_t tx_frames = 0, rx_frames = 0;
  std::uint16_t tx_errors = 0, rx_error_oom = 0, rx_error_internal = 0, rx_error_missed_start = 0, rx_error_wrong_toggle = 0,
                rx_error_short_frame = 0, rx_error_bad_crc = 0, rx_ignored_wrong_address = 0, rx_ignored_not_wanted = 0,
                rx_ignored_unexpected_tid = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("tx_frames", u(32), v.tx_frames);
    f.value("tx_errors", u(16), v.tx_errors);
    f.value("rx_frames", u(32), v.rx_frames);
    f.value("rx_error_oom", u(16), v.rx_error_oom);
    f.value("rx_error_internal", u(16), v.rx_error_internal);
    f.value("rx_error_missed_start", u(16), v.rx_error_missed_start);
    f.value("rx_error_wrong_toggle", u(16), v.rx_error_wrong_toggle);
    f.value("rx_error_short_frame", u(16), v.rx_error_short_frame);
    f.value("rx_error_bad_crc", u(16), v.rx_error_bad_crc);
    f.value("rx_ignored_wrong_address", u(16), v.rx_ignored_wrong_address);
    f.value("rx_ignored_not_wanted", u(16), v.rx_ignored_not_wanted);
    f.value("rx_ignored_unexpected_tid", u(16), v.rx_ignored_unexpected_tid);
  }
};

struct CanStats {
  static constexpr DataType kType{.service = false, .id = 343, .signature = 0xCE080CAE3CA33C75};
  static constexpr const char* kName = "dronecan.protocol.CanStats";
  std::uint8_t interface_number = 0;
  std::uint32_t tx_requests = 0, rx_received = 0;
  std::uint16_t tx_rejected = 0, tx_overflow = 0, tx_success = 0, tx_timedout = 0, tx_abort = 0, rx_overflow = 0, rx_errors = 0,
                busoff_errors = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("interface", u(8), v.interface_number);
    f.value("tx_requests", u(32), v.tx_requests);
    f.value("tx_rejected", u(16), v.tx_rejected);
    f.value("tx_overflow", u(16), v.tx_overflow);
    f.value("tx_success", u(16), v.tx_success);
    f.value("tx_timedout", u(16), v.tx_timedout);
    f.value("tx_abort", u(16), v.tx_abort);
    f.value("rx_received", u(32), v.rx_received);
    f.value("rx_overflow", u(16), v.rx_overflow);
    f.value("rx_errors", u(16), v.rx_errors);
    f.value("busoff_errors", u(16), v.busoff_errors);
  }
};

struct Timestamp {
  static constexpr const char* kName = "uavcan.Timestamp";
  std::uint64_t us = 0;  // 56 bits; 0: not known
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("usec", truncated_u(56), v.us);
  }
};

struct GlobalTime {
  static constexpr DataType kType{.service = false, .id = 344, .signature = 0xA55177448A490F33};
  static constexpr const char* kName = "dronecan.protocol.GlobalTime";
  Timestamp timestamp{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested_tail("timestamp", v.timestamp);
  }
};

}  // namespace rotorloop::protocols
