// Reassembly of DroneCAN transfers in bounded memory. The rules are those of the specification ("CAN bus transport layer",
// transfer reception): one session per (kind, type, source); a session restarts when it is new, when its last start is older
// than 2 s, or when a start frame comes whose transfer id is neither the expected nor the previous one; a repeated transfer is
// dropped; frames with the wrong toggle or transfer id are dropped. Everything abnormal is counted by name.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocols/can_frame.hpp"
#include "protocols/crc.hpp"
#include "protocols/transfer.hpp"

namespace rotorloop::protocols {

inline constexpr std::uint64_t kTransferTimeout_us = 2'000'000;

// What a receiver wants to hear. Frames of other types are passed over.
struct Subscription {
  TransferKind kind = TransferKind::message;
  std::uint16_t data_type_id = 0;
  std::uint16_t crc_seed = 0;
};
constexpr Subscription subscribe(TransferKind kind, const DataType& type) {
  return {.kind = kind, .data_type_id = type.id, .crc_seed = type.crc_seed()};
}

struct ReceiverCounters {
  std::uint32_t transfers = 0;          // delivered
  std::uint32_t not_subscribed = 0;     // frames of other types or for other nodes: normal on a shared bus
  std::uint32_t anonymous = 0;          // frames without source node
  std::uint32_t bad_frame = 0;          // no tail byte, or a frame before the last one that is not full
  std::uint32_t bad_address = 0;        // a service with source or destination 0, or sent by the receiver's own id
  std::uint32_t bad_start = 0;          // start of transfer with the toggle set (another protocol version)
  std::uint32_t missed_start = 0;       // a later frame of a transfer whose start was not seen
  std::uint32_t wrong_toggle = 0;       // a frame repeated or lost within a transfer
  std::uint32_t wrong_transfer_id = 0;  // not the transfer in progress
  std::uint32_t duplicate = 0;          // start of a transfer with the id of the one before
  std::uint32_t aborted = 0;            // a transfer in progress given up for a new one or for its age
  std::uint32_t wrong_crc = 0;          // damaged, or the sender's data type has another signature
  std::uint32_t too_long = 0;           // more payload than any subscribed type has
  std::uint32_t no_session = 0;         // all sessions busy with other senders
};

struct Transfer {
  FrameId id;
  std::uint8_t transfer_id = 0;
  std::uint64_t start_us = 0;               // arrival of the first frame
  std::span<const std::uint8_t> payload{};  // valid until the next accept()
};

// Sessions: how many (kind, type, source) are followed at once. MaxPayload: longest payload in bytes. About
// MaxPayload + 32 bytes of memory per session.
template <std::size_t Sessions, std::size_t MaxPayload>
class Receiver {
  static_assert(MaxPayload >= 7, "a single frame must fit");

 public:
  // `subscriptions` must outlive the receiver. `own_node` selects the services that are for us.
  constexpr Receiver(std::uint8_t own_node, std::span<const Subscription> subscriptions)
      : subscriptions_(subscriptions), own_node_(own_node) {}

  constexpr std::optional<Transfer> accept(const CanFrame& frame, std::uint64_t now_us) {
    if (!frame.extended) return std::nullopt;
    const FrameId id = decode_id(frame.id);
    if (id.source == kNoNode) {
      // No anonymous type is subscribed to: such frames carry a truncated type id.
      ++(id.kind == TransferKind::message ? counters_.anonymous : counters_.bad_address);
      return std::nullopt;
    }
    const Subscription* wanted = find_subscription(id);
    if (wanted == nullptr) {
      ++counters_.not_subscribed;
      return std::nullopt;
    }
    if (id.kind != TransferKind::message) {
      if (id.destination == kNoNode || id.source == own_node_) {
        ++counters_.bad_address;
        return std::nullopt;
      }
      if (id.destination != own_node_) {
        ++counters_.not_subscribed;
        return std::nullopt;
      }
    }
    if (frame.length == 0 || frame.length > 8) {
      ++counters_.bad_frame;
      return std::nullopt;
    }
    const Tail tail = decode_tail(frame.data[frame.length - 1u]);
    const std::span<const std::uint8_t> content(frame.data.data(), frame.length - 1u);
    if (tail.start && tail.toggle) {
      ++counters_.bad_start;
      return std::nullopt;
    }
    if (!tail.end && frame.length != 8) {
      ++counters_.bad_frame;
      return std::nullopt;
    }
    Session* session = find_session(id, tail.start, now_us);
    if (session == nullptr) return std::nullopt;
    return step(*session, *wanted, id, tail, content, now_us);
  }

  constexpr const ReceiverCounters& counters() const { return counters_; }

 private:
  struct Session {
    std::uint64_t start_us = 0;
    std::size_t size = 0;  // payload bytes so far, without the CRC
    std::array<std::uint8_t, MaxPayload> payload{};
    std::uint16_t crc = 0;  // as sent
    std::uint16_t data_type_id = 0;
    TransferKind kind = TransferKind::message;
    std::uint8_t source = kNoNode;  // kNoNode: free
    std::uint8_t expected_id = 0;
    bool toggle = false;
    bool in_progress = false;
  };

  constexpr const Subscription* find_subscription(const FrameId& id) const {
    for (const Subscription& s : subscriptions_) {
      if (s.data_type_id == id.data_type_id && s.kind == id.kind) return &s;
    }
    return nullptr;
  }

  constexpr Session* find_session(const FrameId& id, bool start, std::uint64_t now_us) {
    Session* unused = nullptr;
    for (Session& s : sessions_) {
      if (s.source == id.source && s.data_type_id == id.data_type_id && s.kind == id.kind) return &s;
      if (unused == nullptr && (s.source == kNoNode || now_us - s.start_us > kTransferTimeout_us)) unused = &s;
    }
    if (!start) {
      ++counters_.missed_start;
      return nullptr;
    }
    if (unused == nullptr) {
      ++counters_.no_session;
      return nullptr;
    }
    if (unused->source != kNoNode && unused->in_progress) ++counters_.aborted;
    unused->source = id.source;
    unused->data_type_id = id.data_type_id;
    unused->kind = id.kind;
    unused->in_progress = false;
    unused->toggle = false;
    unused->expected_id = kRestart;
    return unused;
  }

  constexpr std::optional<Transfer> step(Session& s, const Subscription& wanted, const FrameId& id, const Tail& tail,
                                         std::span<const std::uint8_t> content, std::uint64_t now_us) {
    const bool late = s.expected_id != kRestart && now_us - s.start_us > kTransferTimeout_us;
    const unsigned behind = (s.expected_id - tail.transfer_id) & (kTransferIdModulo - 1u);  // 0 expected, 1 the one before
    if (s.expected_id == kRestart || late || (tail.start && behind > 1)) {
      if (s.in_progress) ++counters_.aborted;
      s.in_progress = false;
      s.toggle = false;
      s.expected_id = kRestart;
      if (!tail.start) {
        ++counters_.missed_start;
        return std::nullopt;
      }
      s.expected_id = tail.transfer_id;
    }
    if (tail.transfer_id != s.expected_id) {
      ++(tail.start ? counters_.duplicate : counters_.wrong_transfer_id);
      return std::nullopt;
    }
    if (tail.toggle != s.toggle || tail.start == s.in_progress) {
      ++(s.in_progress ? counters_.wrong_toggle : counters_.missed_start);
      return std::nullopt;
    }
    if (tail.start) {
      s.start_us = now_us;
      s.size = 0;
      if (tail.end) {
        finish(s);
        append(s, content);
        return deliver(s, id, tail);
      }
      s.crc = static_cast<std::uint16_t>(content[0] | content[1] << 8);
      content = content.subspan(2);
    }
    if (!append(s, content)) {
      finish(s);
      return std::nullopt;
    }
    s.in_progress = true;
    s.toggle = !s.toggle;
    if (!tail.end) return std::nullopt;
    finish(s);
    if (crc16(wanted.crc_seed, std::span<const std::uint8_t>(s.payload.data(), s.size)) != s.crc) {
      ++counters_.wrong_crc;
      return std::nullopt;
    }
    return deliver(s, id, tail);
  }

  constexpr bool append(Session& s, std::span<const std::uint8_t> content) {
    if (content.size() > MaxPayload - s.size) {
      ++counters_.too_long;
      return false;
    }
    std::copy(content.begin(), content.end(), s.payload.begin() + static_cast<std::ptrdiff_t>(s.size));
    s.size += content.size();
    return true;
  }
  constexpr void finish(Session& s) {
    s.in_progress = false;
    s.toggle = false;
    s.expected_id = static_cast<std::uint8_t>((s.expected_id + 1u) % kTransferIdModulo);
  }
  constexpr Transfer deliver(const Session& s, const FrameId& id, const Tail& tail) {
    ++counters_.transfers;
    return {.id = id,
            .transfer_id = tail.transfer_id,
            .start_us = s.start_us,
            .payload = std::span<const std::uint8_t>(s.payload.data(), s.size)};
  }

  static constexpr std::uint8_t kRestart = 0xFF;  // no transfer id is expected
  std::array<Session, Sessions> sessions_{};
  std::span<const Subscription> subscriptions_;
  ReceiverCounters counters_{};
  std::uint8_t own_node_;
};

}  // namespace rotorloop::protocols
