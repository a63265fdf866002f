// A port of the virtual bus with the clock of the simulated world: what waits on it moves the world on. So a tool that was written for
// a live bus runs against simulated nodes in virtual time, and a second of waiting costs what a second of the nodes costs.
#pragma once
#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "host/bus/timed_bus.hpp"
#include "sim/world/virtual_bus.hpp"

namespace rotorloop::sim {

class LockstepBus final : public TimedBus {
 public:
  // `tick` moves the rest of the world on to the bus's time; called every `tick_ns`, before the port is looked at.
  LockstepBus(VirtualBus& bus, CanBus& port, std::int64_t tick_ns, std::function<void(std::int64_t now_ns)> tick)
      : bus_(bus), port_(port), tick_ns_(tick_ns), tick_(std::move(tick)) {}

  // The virtual bus carries classic frames alone; an FD frame is refused as by a controller without FD.
  SendStatus send_any(const BusFrame& frame) override {
    const auto classic = frame.classic();
    return classic ? port_.send(*classic) : SendStatus::queue_full;
  }
  std::optional<StampedBusFrame> receive_any() override {
    if (waiting_) {
      const auto received = waiting_;
      waiting_.reset();
      return received;
    }
    const auto received = port_.receive();
    if (!received) return std::nullopt;
    return StampedBusFrame{.frame = BusFrame(received->frame), .time_ns = received->time_ns};
  }
  std::int64_t now_ns() const override { return bus_.now_ns(); }
  void wait_until(std::int64_t deadline_ns) override {
    while (!waiting_ && bus_.now_ns() < deadline_ns) {
      bus_.advance_to(std::min(deadline_ns, bus_.now_ns() + tick_ns_));
      tick_(bus_.now_ns());
      if (const auto received = port_.receive())
        waiting_ = StampedBusFrame{.frame = BusFrame(received->frame), .time_ns = received->time_ns};
    }
  }
  BusState state() const override { return port_.state(); }
  PortCounters counters() const override { return port_.counters(); }
  bool set_filters(std::span<const CanFilter> filters) override { return port_.set_filters(filters); }
  std::string name() const override { return "virtual:"; }

 private:
  VirtualBus& bus_;
  CanBus& port_;
  std::int64_t tick_ns_;
  std::function<void(std::int64_t)> tick_;
  std::optional<StampedBusFrame> waiting_;
};

}  // namespace rotorloop::sim
