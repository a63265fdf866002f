// A bus for tests of tools: what is put in comes out, what is sent is kept, and waiting moves its clock.
#pragma once
#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "host/bus/timed_bus.hpp"

namespace rotorloop::tools {

class QueueBus final : public TimedBus {
 public:
  explicit QueueBus(std::size_t capacity = SIZE_MAX) : capacity_(capacity) {}
  SendStatus send_any(const BusFrame& frame) override {
    if (sent.size() >= capacity_) return SendStatus::queue_full;
    sent.push_back({.frame = frame, .time_ns = now});
    return SendStatus::queued;
  }
  std::optional<StampedBusFrame> receive_any() override {
    if (waiting.empty() || waiting.front().time_ns > now) return std::nullopt;
    const StampedBusFrame f = waiting.front();
    waiting.pop_front();
    return f;
  }
  std::int64_t now_ns() const override { return now; }
  void wait_until(std::int64_t deadline_ns) override {
    now = std::max(now, waiting.empty() ? deadline_ns : std::min(deadline_ns, waiting.front().time_ns));
  }
  BusState state() const override { return BusState::error_active; }
  PortCounters counters() const override { return {}; }
  std::string name() const override { return "queue"; }

  std::deque<StampedBusFrame> waiting;
  std::vector<StampedBusFrame> sent;
  std::int64_t now = 0;

 private:
  std::size_t capacity_;
};

inline BusFrame extended_frame(std::uint32_t id, std::uint8_t first_byte = 0) {
  BusFrame f;
  f.id = id;
  f.extended = true;
  f.length = 1;
  f.data[0] = first_byte;
  return f;
}

}  // namespace rotorloop::tools
