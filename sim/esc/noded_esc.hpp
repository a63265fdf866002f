// An ESC on a bus: joins any ESC of this folder to a firmware node and a bus port. The node task runs at 4 kHz (every sixth
// current-loop period), as the firmware's main loop does: frames in, set-point out, telemetry in, frames out.
#pragma once
#include <concepts>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "firmware/core/interface.hpp"
#include "firmware/core/node/main_loop.hpp"
#include "host/base/random.hpp"
#include "host/bus/can_bus.hpp"
#include "sim/esc/esc_setup.hpp"

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

  // `setup`: defects between node and motor control; `noise` is drawn from only when the setup has speed noise.
  NodedEsc(Esc esc, Node node, CanBus& port, const EscSetup& setup = {}, RandomStream noise = {0, 0})
      : esc_(std::move(esc)), node_(std::move(node)), port_(&port), setup_(setup), noise_(noise) {}

  // One 24 kHz period.
  void step_current_loop() {
    run_node();
    esc_.step_current_loop();
  }
  // The node's share of a period alone, for a caller that steps several ESCs together afterwards.
  void run_node() {
    if (period_++ % kPeriodsPerPoll == 0) poll();
  }
  Esc& esc() { return esc_; }
  const Esc& esc() const { return esc_; }
  Node& node() { return node_; }

 private:
  void poll() {
    const std::int64_t now_us = esc_.time_us();
    for (std::size_t i = 0; i < firmware::kFramesPerPoll; ++i) {
      const auto received = port_->receive();
      if (!received) break;
      node_.on_frame(received->frame, now_us);
    }
    node_.poll(now_us, reported());
    if (setup_.report_delay_ns == 0) {
      while (const auto frame = node_.next_frame()) port_->send(*frame);
    } else {
      while (const auto frame = node_.next_frame()) held_.push_back({now_us + setup_.report_delay_ns / 1000, *frame});
      for (; !held_.empty() && held_.front().due_us <= now_us; held_.pop_front()) port_->send(held_.front().frame);
    }
    firmware::Setpoint wanted = node_.setpoint(now_us);
    // What the box takes for the wanted speed is another one in truth.
    if (wanted.mode == firmware::Mode::speed) wanted.value = static_cast<float>(static_cast<double>(wanted.value) / setup_.speed_scale);
    esc_.set_setpoint(wanted);
  }
  firmware::Telemetry reported() {
    firmware::Telemetry t = esc_.telemetry();
    if (setup_.speed_scale != 1.0) t.speed_rad_s = static_cast<float>(static_cast<double>(t.speed_rad_s) * setup_.speed_scale);
    if (setup_.speed_noise_rad_s > 0.0 && t.speed_valid)
      t.speed_rad_s += static_cast<float>(setup_.speed_noise_rad_s * noise_.gaussian(period_));
    return t;
  }

  struct Held {
    std::int64_t due_us;
    CanFrame frame;
  };
  Esc esc_;
  Node node_;
  CanBus* port_;
  EscSetup setup_;
  RandomStream noise_;
  std::deque<Held> held_;  // frames on their way through a slow gateway
  std::uint64_t period_ = 0;
};

}  // namespace rotorloop::sim
