// What the updater says on the bus: requests, answers, log lines, its status; a queue of frames until they are sent.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "firmware/core/node/text_line.hpp"
#include "firmware/core/node/transmit_queue.hpp"
#include "protocols/receiver.hpp"
#include "protocols/types.hpp"

namespace rotorloop::firmware {

class UpdateVoice {
 public:
  explicit UpdateVoice(std::uint8_t own_id) : own_id_(own_id) {}
  std::uint8_t own_id() const { return own_id_; }
  void set_own_id(std::uint8_t own_id) { own_id_ = own_id; }
  TransmitQueue<80>& queue() { return queue_; }
  const TransmitQueue<80>& queue() const { return queue_; }

  template <class T>
  void request(std::uint8_t server, std::uint8_t transfer_id, const T& q, std::uint64_t now_us) {
    send({.kind = Kind::request, .priority = kRequestPriority, .data_type_id = T::kType.id, .source = own_id_, .destination = server},
         transfer_id, q, now_us);
  }
  template <class T>
  void respond(const protocols::Transfer& q, const T& value, std::uint64_t now_us) {
    send({.kind = Kind::response, .priority = q.id.priority, .data_type_id = T::kType.id, .source = own_id_, .destination = q.id.source},
         q.transfer_id, value, now_us);
  }
  void status(const protocols::NodeStatus& status, std::uint64_t now_us) {
    send({.kind = Kind::message, .priority = kStatusPriority, .data_type_id = protocols::NodeStatus::kType.id, .source = own_id_},
         status_id_.next(), status, now_us);
  }
  void say(protocols::LogMessage::Level level, const TextLine& line, std::uint64_t now_us) {
    const protocols::LogMessage m{.level = level, .source = "update", .text = line.text()};
    send({.kind = Kind::message, .priority = kLogPriority, .data_type_id = protocols::LogMessage::kType.id, .source = own_id_},
         log_id_.next(), m, now_us);
  }

 private:
  using Kind = protocols::TransferKind;
  static constexpr std::uint8_t kRequestPriority = 24, kStatusPriority = 20, kLogPriority = 28;

  template <class T>
  void send(const protocols::FrameId& header, std::uint8_t transfer_id, const T& value, std::uint64_t now_us) {
    std::array<std::uint8_t, protocols::max_bytes<T>()> payload{};
    const std::size_t size = encode(value, payload);
    if (queue_.room() < protocols::transfer_frames(static_cast<std::uint32_t>(size))) return;
    protocols::encode_transfer(header, T::kType.crc_seed(), transfer_id, {payload.data(), size},
                               [&](const CanFrame& f) { return queue_.push(f, now_us); });
  }

  std::uint8_t own_id_;
  TransmitQueue<80> queue_;
  protocols::TransferIdCounter status_id_, log_id_;
};

}  // namespace rotorloop::firmware
