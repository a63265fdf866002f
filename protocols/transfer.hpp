// DroneCAN transfers, sending side: identifiers, tail byte, splitting into frames of classic CAN or CAN FD (docs/wire.md §1).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocols/bus_load.hpp"
#include "protocols/can_frame.hpp"
#include "protocols/crc.hpp"

namespace rotorloop::protocols {

enum class TransferKind : std::uint8_t { message, request, response };

// A data type as the transport sees it. A service's request and response share id and signature.
struct DataType {
  bool service = false;
  std::uint16_t id = 0;  // messages 0..65535, services 0..255
  std::uint64_t signature = 0;
  constexpr std::uint16_t crc_seed() const { return crc16_of_signature(signature); }
};

inline constexpr std::uint8_t kNoNode = 0;  // anonymous source, or broadcast destination
inline constexpr std::uint8_t kMaxNode = 127;
inline constexpr std::uint8_t kTransferIdModulo = 32;

struct FrameId {
  TransferKind kind = TransferKind::message;
  std::uint8_t priority = 16;  // 0 wins .. 31
  std::uint16_t data_type_id = 0;
  std::uint8_t source = kNoNode;
  std::uint8_t destination = kNoNode;  // services only
  std::uint16_t discriminator = 0;     // anonymous messages (source 0) only: 14 bits that keep two senders apart
  friend constexpr bool operator==(const FrameId&, const FrameId&) = default;
};

constexpr std::uint32_t encode_id(const FrameId& f) {
  const std::uint32_t priority = (f.priority & 31u) << 24, source = f.source & 127u;
  if (f.kind == TransferKind::message) {
    if (f.source == kNoNode) return priority | (f.discriminator & 0x3FFFu) << 10 | (f.data_type_id & 3u) << 8;
    return priority | static_cast<std::uint32_t>(f.data_type_id) << 8 | source;
  }
  const std::uint32_t request = f.kind == TransferKind::request ? 1u : 0u;
  return priority | (f.data_type_id & 0xFFu) << 16 | request << 15 | (f.destination & 127u) << 8 | 0x80u | source;
}

// Of an anonymous message (source 0) only the low two bits of the type id are on the wire; the rest is a discriminator.
constexpr FrameId decode_id(std::uint32_t id) {
  FrameId f;
  f.priority = static_cast<std::uint8_t>(id >> 24 & 31u);
  f.source = static_cast<std::uint8_t>(id & 127u);
  if ((id & 0x80u) != 0) {
    f.kind = (id & 0x8000u) != 0 ? TransferKind::request : TransferKind::response;
    f.data_type_id = static_cast<std::uint16_t>(id >> 16 & 0xFFu);
    f.destination = static_cast<std::uint8_t>(id >> 8 & 127u);
  } else if (f.source == kNoNode) {
    f.data_type_id = static_cast<std::uint16_t>(id >> 8 & 3u);
    f.discriminator = static_cast<std::uint16_t>(id >> 10 & 0x3FFFu);
  } else {
    f.data_type_id = static_cast<std::uint16_t>(id >> 8 & 0xFFFFu);
  }
  return f;
}

struct Tail {
  bool start = true, end = true, toggle = false;
  std::uint8_t transfer_id = 0;
};
constexpr std::uint8_t encode_tail(const Tail& t) {
  return static_cast<std::uint8_t>((t.start ? 0x80u : 0u) | (t.end ? 0x40u : 0u) | (t.toggle ? 0x20u : 0u) | (t.transfer_id & 31u));
}
constexpr Tail decode_tail(std::uint8_t byte) {
  return {.start = (byte & 0x80u) != 0,
          .end = (byte & 0x40u) != 0,
          .toggle = (byte & 0x20u) != 0,
          .transfer_id = static_cast<std::uint8_t>(byte & 31u)};
}

// One counter per (kind, type, destination) at the sender: the number to use now, then one more.
struct TransferIdCounter {
  std::uint8_t value = 0;
  constexpr std::uint8_t next() {
    const std::uint8_t now = value;
    value = static_cast<std::uint8_t>((value + 1u) % kTransferIdModulo);
    return now;
  }
};

// Splits a payload into frames and hands each to `sink(const CanFrame&) -> bool`. False when the sink refused a frame: the
// rest is not offered, so a caller that cannot take back frames asks its queue for transfer_frames(size) places first.
template <class Sink>
constexpr bool encode_transfer(const FrameId& header, std::uint16_t crc_seed, std::uint8_t transfer_id,
                               std::span<const std::uint8_t> payload, Sink&& sink) {
  CanFrame f{.id = encode_id(header), .extended = true, .length = 0, .data = {}};
  if (payload.size() <= 7) {
    for (std::size_t i = 0; i < payload.size(); ++i) f.data[i] = payload[i];
    f.data[payload.size()] = encode_tail({.start = true, .end = true, .toggle = false, .transfer_id = transfer_id});
    f.length = static_cast<std::uint8_t>(payload.size() + 1);
    return sink(static_cast<const CanFrame&>(f));
  }
  const std::uint16_t crc = crc16(crc_seed, payload);
  f.data[0] = static_cast<std::uint8_t>(crc & 0xFFu);
  f.data[1] = static_cast<std::uint8_t>(crc >> 8);
  std::size_t at = 2, next = 0;
  for (bool toggle = false;; toggle = !toggle) {
    while (at < 7 && next < payload.size()) f.data[at++] = payload[next++];
    const bool end = next == payload.size();
    f.data[at] = encode_tail({.start = next <= 5, .end = end, .toggle = toggle, .transfer_id = transfer_id});
    f.length = static_cast<std::uint8_t>(at + 1);
    if (!sink(static_cast<const CanFrame&>(f))) return false;
    if (end) return true;
    f.data = {};
    at = 0;
  }
}

// The same on CAN FD: up to 63 payload bytes a frame, zeros between the payload and the last frame's tail byte up to the next
// length that CAN FD has. The CRC of a multi-frame transfer includes these zeros.
template <class Sink>
constexpr bool encode_transfer_fd(const FrameId& header, std::uint16_t crc_seed, std::uint8_t transfer_id,
                                  std::span<const std::uint8_t> payload, Sink&& sink) {
  constexpr std::size_t kContent = 63;
  CanFdFrame f;
  f.id = encode_id(header);
  f.extended = true;
  const bool multi = payload.size() > kContent;
  const std::size_t head = multi ? 2 : 0, rest = (payload.size() + head) % kContent;
  const std::size_t in_last = rest == 0 && multi ? kContent : payload.size() + head <= kContent ? payload.size() : rest;
  const std::size_t padding = fd_length(static_cast<std::uint32_t>(in_last + 1)) - (in_last + 1);
  std::uint16_t crc = multi ? crc16(crc_seed, payload) : std::uint16_t{0};
  for (std::size_t n = 0; multi && n < padding; ++n) crc = crc16(crc, std::uint8_t{0});
  const std::size_t total = head + payload.size() + padding;
  std::size_t next = 0;  // of the stream CRC, payload, zeros
  for (bool toggle = false;; toggle = !toggle) {
    const bool start = next == 0;
    f.data = {};
    std::size_t at = 0;
    for (; at < kContent && next < total; ++at, ++next) {
      f.data[at] = next < head                    ? static_cast<std::uint8_t>(next == 0 ? crc & 0xFFu : crc >> 8)
                   : next - head < payload.size() ? payload[next - head]
                                                  : std::uint8_t{0};
    }
    const bool end = next == total;
    f.data[at] = encode_tail({.start = start, .end = end, .toggle = toggle, .transfer_id = transfer_id});
    f.length = static_cast<std::uint8_t>(at + 1);
    if (!sink(static_cast<const CanFdFrame&>(f))) return false;
    if (end) return true;
  }
}

}  // namespace rotorloop::protocols
