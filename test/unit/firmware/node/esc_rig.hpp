// A node under test with a clock, a telemetry that can be set, and the frames of a host that commands it.
#pragma once
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "firmware/core/node/esc_node.hpp"
#include "protocols/receiver.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types.hpp"

namespace rotorloop::firmware {

inline constexpr std::uint8_t kHost = 120;
inline constexpr float kRpm = protocols::fast::kRadPerSecondPerRpm;

inline Parameters valid_parameters() {
  Parameters p;
  p.node_id = 42;
  p.esc_index = 2;
  p.bidirectional = true;
  return p;
}

inline Telemetry warm_telemetry() {
  Telemetry t;
  t.bus_V = 16.0f;
  t.temperature_K = 313.0f;
  return t;
}

class EscRig {
 public:
  explicit EscRig(const Parameters& p = valid_parameters(), const NodeIdentity& identity = {}, const NodeRules& rules = {})
      : node(p, identity, rules) {
    poll();
    advance_us(1000);  // the second poll ends initialization
  }

  void poll() {
    node.poll(now_us, telemetry);
    while (const auto f = node.next_frame()) sent.push_back(*f);
  }
  // Polls every millisecond, like the application.
  void advance_us(std::uint64_t dt_us) {
    const std::uint64_t end_us = now_us + dt_us;
    while (now_us < end_us) {
      now_us = now_us + 1000 < end_us ? now_us + 1000 : end_us;
      poll();
    }
  }

  template <class T>
  void send(const T& value, std::uint8_t source = kHost) {
    std::array<std::uint8_t, 64> payload{};
    const std::size_t size = encode(value, payload);
    send_payload({.kind = protocols::TransferKind::message, .priority = 7, .data_type_id = T::kType.id, .source = source},
                 T::kType.crc_seed(), {payload.data(), size});
  }
  void send_payload(const protocols::FrameId& id, std::uint16_t seed, std::span<const std::uint8_t> payload) {
    protocols::encode_transfer(id, seed, transfer_id_.next(), payload, [&](const CanFrame& f) {
      node.on_frame(f, now_us);
      return true;
    });
  }
  void arm() { send(protocols::ArmingStatus{.status = 255}); }
  void disarm() { send(protocols::ArmingStatus{.status = 0}); }
  void raw(std::initializer_list<std::int16_t> values) {
    protocols::RawCommand c;
    for (const std::int16_t v : values) c.command[c.count++] = v;
    send(c);
  }
  void rpm(std::initializer_list<std::int32_t> values) {
    protocols::RpmCommand c;
    for (const std::int32_t v : values) c.rpm[c.count++] = v;
    send(c);
  }
  // The next set-point of the group, all four slots alike.
  void fast(float value, protocols::fast::SetpointMode mode = protocols::fast::SetpointMode::rpm) {
    fast_with_sequence(++sequence, value, mode);
  }
  void fast_with_sequence(std::uint8_t number, float value, protocols::fast::SetpointMode mode = protocols::fast::SetpointMode::rpm) {
    protocols::fast::Setpoint s{.mode = mode, .group = 0, .sequence = static_cast<std::uint8_t>(number & 15)};
    for (int i = 0; i < 4; ++i) s.set(i, value);
    node.on_frame(encode(s), now_us);
  }

  Setpoint setpoint() const { return node.setpoint(now_us); }
  bool spins() const { return setpoint().mode != Mode::off; }

  // Of what was sent: the transfers of one type, whole ones only.
  template <class T>
  std::vector<T> received(protocols::TransferKind kind = protocols::TransferKind::message) const {
    const std::array<protocols::Subscription, 1> subscriptions{protocols::subscribe(kind, T::kType)};
    protocols::Receiver<8, 400> receiver(kHost, subscriptions);
    std::vector<T> result;
    std::uint64_t t_us = 0;
    for (const CanFrame& f : sent) {
      if (const auto t = receiver.accept(f, ++t_us)) {
        T value;
        if (decode(t->payload, value)) result.push_back(value);
      }
    }
    return result;
  }
  std::vector<protocols::fast::Feedback> feedback() const {
    std::vector<protocols::fast::Feedback> result;
    for (const CanFrame& f : sent) {
      if (const auto b = protocols::fast::decode_feedback(f)) result.push_back(*b);
    }
    return result;
  }

  std::uint64_t now_us = 5'000'000;  // not zero: freshness must not depend on the start of the clock
  Telemetry telemetry = warm_telemetry();
  EscNode node;
  std::vector<CanFrame> sent;
  std::uint8_t sequence = 0;

 private:
  protocols::TransferIdCounter transfer_id_;
};

}  // namespace rotorloop::firmware
