// Reassembly of DroneCAN transfers in bounded memory. The rules are those of the specification ("CAN bus transport layer",
// transfer reception): one session per (kind, type, source); a session restarts when it is new, when its last start is older
// than 2 s, or when a start frame comes whose transfer id is neither the expected nor the previous one; a repeated transfer is
// dropped; frames with the wrong toggle or transfer id are dropped. Everything abnormal is counted by name.
// Frames of classic CAN and of CAN FD are taken alike; each transfer says which it came in, and is answered in the same.
// When all sessions are taken, a new sender gets the place of the one that started least recently, never that of keep(): a flood of
// senders cannot lock out a newcomer, nor the one that is obeyed.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocols/can_frame.hpp"
#include "protocols/crc.hpp"
#include "protocols/dsdl.hpp"
#include "protocols/transfer.hpp"

namespace rotorloop::protocols {

inline constexpr std::uint64_t kTransferTimeout_us = 2'000'000;

// What a receiver wants to hear. Frames of other types are passed over.
struct Subscription {
  TransferKind kind = TransferKind::message;
  std::uint16_t data_type_id = 0;
  std::uint16_t crc_seed = 0;
  bool anonymous = false;  // messages without a source node are wanted too; only types 0..3 can be sent so
};
constexpr Subscription subscribe_anonymous(const DataType& type) {
  return {.kind = TransferKind::message, .data_type_id = type.id, .crc_seed = type.crc_seed(), .anonymous = true};
}
constexpr Subscription subscribe(TransferKind kind, const DataType& type) {
  return {.kind = kind, .data_type_id = type.id, .crc_seed = type.crc_seed()};
}

struct ReceiverCounters {
  std::uint32_t transfers = 0;          // delivered
  std::uint32_t not_subscribed = 0;     // frames of other types or for other nodes: normal on a shared bus
  std::uint32_t anonymous = 0;          // frames without source node that nobody asked for, or that are no single-frame message
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
  std::uint32_t no_session = 0;         // all sessions belong to the sender that is kept
  std::uint32_t displaced = 0;          // sessions of one sender given to another before they were 2 s old
};

struct Transfer {
  FrameId id;
  std::uint8_t transfer_id = 0;
  std::uint64_t start_us = 0;               // arrival of the first frame
  std::span<const std::uint8_t> payload{};  // valid until the next accept(); on CAN FD with the zeros that fill the last frame
  Framing framing = Framing::classic;
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

  // CanFrame or CanFdFrame.
  template <class Frame>
  constexpr std::optional<Transfer> accept(const Frame& frame, std::uint64_t now_us) {
    constexpr bool kFd = sizeof(frame.data) > 8;
    if (!frame.extended) return std::nullopt;
    const FrameId id = decode_id(frame.id);
    const Subscription* wanted = find_subscription(id);
    if (!addressed(id, wanted)) return std::nullopt;
    if (frame.length == 0 || frame.length > frame.data.size() || (kFd && fd_length(frame.length) != frame.length)) {
      ++counters_.bad_frame;
      return std::nullopt;
    }
    const Tail tail = decode_tail(frame.data[frame.length - 1u]);
    const std::span<const std::uint8_t> content(frame.data.data(), frame.length - 1u);
    if (tail.start && tail.toggle) {
      ++counters_.bad_start;
      return std::nullopt;
    }
    if (!tail.end && frame.length != frame.data.size()) {
      ++counters_.bad_frame;
      return std::nullopt;
    }
    constexpr Framing kFraming = kFd ? Framing::fd : Framing::classic;
    if (id.source == kNoNode) return accept_anonymous(id, tail, content, now_us, kFraming);
    Session* session = find_session(id, tail.start, now_us);
    if (session == nullptr) return std::nullopt;
    return step(*session, *wanted, id, tail, content, now_us, kFraming);
  }

  // The sender whose sessions are never given to another one: the commander that is obeyed. kNoNode: none.
  constexpr void keep(std::uint8_t source) { kept_ = source; }
  // After an id was allocated.
  constexpr void set_own_node(std::uint8_t node) { own_node_ = node; }

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
    Framing framing = Framing::classic;  // of the transfer in progress
  };

  // Counts why a frame is none of our business.
  constexpr bool addressed(const FrameId& id, const Subscription* wanted) {
    if (id.source == kNoNode) {
      if (id.kind == TransferKind::message && wanted != nullptr && wanted->anonymous) return true;
      ++(id.kind == TransferKind::message ? counters_.anonymous : counters_.bad_address);
      return false;
    }
    if (wanted == nullptr) {
      ++counters_.not_subscribed;
      return false;
    }
    if (id.kind == TransferKind::message) return true;
    if (id.destination == kNoNode || id.source == own_node_) {
      ++counters_.bad_address;
      return false;
    }
    if (id.destination != own_node_) {
      ++counters_.not_subscribed;
      return false;
    }
    return true;
  }

  // Single frames without a state: nobody can say whose transfer ids they are.
  constexpr std::optional<Transfer> accept_anonymous(const FrameId& id, const Tail& tail, std::span<const std::uint8_t> content,
                                                     std::uint64_t now_us, Framing framing) {
    if (!tail.start || !tail.end) {
      ++counters_.anonymous;
      return std::nullopt;
    }
    if (content.size() > anonymous_.size()) {
      ++counters_.too_long;
      return std::nullopt;
    }
    std::copy(content.begin(), content.end(), anonymous_.begin());
    ++counters_.transfers;
    return Transfer{.id = id,
                    .transfer_id = tail.transfer_id,
                    .start_us = now_us,
                    .payload = std::span<const std::uint8_t>(anonymous_.data(), content.size()),
                    .framing = framing};
  }

  constexpr const Subscription* find_subscription(const FrameId& id) const {
    for (const Subscription& s : subscriptions_) {
      if (s.data_type_id == id.data_type_id && s.kind == id.kind) return &s;
    }
    return nullptr;
  }

  constexpr Session* find_session(const FrameId& id, bool start, std::uint64_t now_us) {
    Session* place = nullptr;
    for (Session& s : sessions_) {
      if (s.source == id.source && s.data_type_id == id.data_type_id && s.kind == id.kind) return &s;
      if (kept(s, now_us)) continue;
      if (place == nullptr || age_us(s, now_us) > age_us(*place, now_us)) place = &s;
    }
    if (!start) {
      ++counters_.missed_start;
      return nullptr;
    }
    if (place == nullptr) {
      ++counters_.no_session;
      return nullptr;
    }
    if (place->source != kNoNode) {
      if (place->in_progress) ++counters_.aborted;
      if (now_us - place->start_us <= kTransferTimeout_us) ++counters_.displaced;
    }
    place->source = id.source;
    place->data_type_id = id.data_type_id;
    place->kind = id.kind;
    place->in_progress = false;
    place->toggle = false;
    place->expected_id = kRestart;
    return place;
  }
  constexpr bool kept(const Session& s, std::uint64_t now_us) const {
    return s.source != kNoNode && s.source == kept_ && now_us - s.start_us <= kTransferTimeout_us;
  }
  // A free place is older than any.
  static constexpr std::uint64_t age_us(const Session& s, std::uint64_t now_us) {
    return s.source == kNoNode ? ~std::uint64_t{0} : now_us - s.start_us;
  }

  constexpr std::optional<Transfer> step(Session& s, const Subscription& wanted, const FrameId& id, const Tail& tail,
                                         std::span<const std::uint8_t> content, std::uint64_t now_us, Framing framing) {
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
    if (!tail.start && framing != s.framing) {
      ++counters_.bad_frame;
      return std::nullopt;
    }
    if (tail.start) {
      s.start_us = now_us;
      s.size = 0;
      s.framing = framing;
      if (tail.end) {
        finish(s);
        return append(s, content) ? std::optional<Transfer>(deliver(s, id, tail)) : std::nullopt;
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
            .payload = std::span<const std::uint8_t>(s.payload.data(), s.size),
            .framing = s.framing};
  }

  static constexpr std::uint8_t kRestart = 0xFF;  // no transfer id is expected
  std::array<Session, Sessions> sessions_{};
  std::span<const Subscription> subscriptions_;
  ReceiverCounters counters_{};
  std::array<std::uint8_t, std::min<std::size_t>(MaxPayload, 63)> anonymous_{};
  std::uint8_t own_node_;
  std::uint8_t kept_ = kNoNode;
};

}  // namespace rotorloop::protocols
