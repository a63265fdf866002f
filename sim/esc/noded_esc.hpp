// An ESC on a bus: joins any ESC of this folder to a firmware node and a bus port. The node task runs at 4 kHz (every sixth
// current-loop period), as the firmware's main loop does: frames in, set-point out, telemetry in, frames out.
#pragma once
#include <concepts>
#include <cstdint>
#include <optional>
#include <utility>

#include "firmware/core/interface.hpp"
#include "host/bus/can_bus.hpp"

namespace rotorloop::sim {

template <class N>
concept BusNode = requires(N n, const CanFrame& frame, std::int64_t time_us, const firmware::Telemetry& telemetry) {
  n.on_frame(frame, time_us);
  n.poll(time_us, telemetry);
  { n.next_frame() } -> std::same_as<std::optional<CanFrame>>;
  { n.setpoint(time_us) } -> std::convertible_to<firmware::Setpoint>;
};

template <class Esc, BusNode Node>
class NodedEsc {
 public:
  static constexpr std::uint64_t kPeriodsPerPoll = 6;

  NodedEsc(Esc esc, Node node, CanBus& port) : esc_(std::move(esc)), node_(std::move(node)), port_(&port) {}

  // One 24 kHz period.
  void step_current_loop() {
    if (period_++ % kPeriodsPerPoll == 0) poll();
    esc_.step_current_loop();
  }
  Esc& esc() { return esc_; }
  const Esc& esc() const { return esc_; }
  Node& node() { return node_; }

 private:
  void poll() {
    const std::int64_t now_us = esc_.time_us();
    while (const auto received = port_->receive()) node_.on_frame(received->frame, now_us);
    node_.poll(now_us, esc_.telemetry());
    while (const auto frame = node_.next_frame()) port_->send(*frame);
    esc_.set_setpoint(node_.setpoint(now_us));
  }
  Esc esc_;
  Node node_;
  CanBus* port_;
  std::uint64_t period_ = 0;
};

}  // namespace rotorloop::sim
