// The main loop of an ESC, one turn of it: frames in, node, frames out, set-point to the motor control, and what the node asks of the
// hardware. It is the same code on a board, in the simulator (sim/esc) and in `rotorloop esc-sim`. A board's program:
//   EscFirmware<MyBoard> esc(board, identity);
//   sample interrupt: esc.on_sample(board);
//   for (;;) esc.poll(board);          every kPoll_us; sooner does no harm
// After a reset an updater comes first when UpdateRecord holds a job or no image is whole (firmware/update).
#pragma once
#include <concepts>
#include <cstddef>
#include <cstdint>

#include "firmware/app/esc_control.hpp"
#include "firmware/board/application_board.hpp"
#include "firmware/core/interface.hpp"
#include "firmware/core/node/esc_node.hpp"
#include "firmware/core/node/main_loop.hpp"
#include "firmware/core/node/node_store.hpp"
#include "firmware/update/update_record.hpp"

namespace rotorloop::firmware {

// The motor side as the main loop sees it; EscControl is the product's.
template <class C, class Node>
concept ControlOf = requires(C c, const C& reader, const Setpoint& s, Node& node) {
  c.set_setpoint(s);
  { c.telemetry() } -> std::same_as<Telemetry>;
  c.serve(node);
  { reader.samples() } -> std::same_as<std::uint32_t>;  // interrupts until now; may wrap
};

struct ApplicationCounters {
  std::uint32_t bus_recoveries = 0;        // begun after bus off
  std::uint32_t polls_without_sample = 0;  // no sample interrupt since the poll before: the watchdog was not kicked
  std::uint32_t longest_wait_us = 0;       // of a frame for its poll
};

template <class Node = EscNode>
class EscApplication {
 public:
  static constexpr std::uint64_t kRecover_us = 10'000;  // between two tries to leave bus off; the wait itself takes 1.4 ms at 1 Mbit/s

  explicit EscApplication(const Node& node) : node_(node) {}
  // The node made in its place: on a target a second one would not fit the stack.
  EscApplication(const Parameters& p, const NodeIdentity& identity) : node_(p, identity) {}

  template <ApplicationBoard B, ControlOf<Node> Control>
  void poll(B& board, Control& control) {
    const std::uint64_t now_us = board.time_us();
    if (!started_) {
      board.can().set_filters({});  // all: the node also looks for its own id in the frames of others
      started_ = true;
    }
    watch_processor(board, control);
    watch_bus(board.can(), now_us);
    control.serve(node_);
    take_frames(board.can(), now_us);
    node_.poll(now_us, control.telemetry());
    while (board.can().ready()) {
      const auto frame = node_.next_frame();
      if (!frame) break;
      board.can().send(*frame);
    }
    control.set_setpoint(node_.setpoint(now_us));
    if constexpr (requires { node_.request(); }) serve_requests(board);
  }

  Node& node() { return node_; }
  const Node& node() const { return node_; }
  const ApplicationCounters& counters() const { return counters_; }

 private:
  // The watchdog is kicked only when both contexts are alive: this one, and the sample interrupt.
  template <class B, class Control>
  void watch_processor(B& board, const Control& control) {
    const std::uint32_t samples = control.samples();
    if (samples != samples_)
      board.kick_watchdog();
    else
      ++counters_.polls_without_sample;
    samples_ = samples;
  }

  template <class Port>
  void watch_bus(Port& can, std::uint64_t now_us) {
    if (can.state() != BusState::bus_off || now_us < next_recovery_us_) return;
    next_recovery_us_ = now_us + kRecover_us;
    ++counters_.bus_recoveries;
    can.recover();
  }

  template <class Port>
  void take_frames(Port& can, std::uint64_t now_us) {
    for (std::size_t i = 0; i < kFramesPerPoll; ++i) {
      const auto received = can.receive();
      if (!received) break;
      const auto waited_us = static_cast<std::uint32_t>(now_us - received->time_us);
      if (received->time_us <= now_us && waited_us > counters_.longest_wait_us) counters_.longest_wait_us = waited_us;
      node_.on_frame(received->frame, now_us);
    }
  }

  // Blocks while the flash works: the node asks for it only while the motor is off.
  template <class B>
  void serve_requests(B& board) {
    ParameterStore store(board);
    serve_store(node_, store);
    const NodeRequest request = node_.request();
    if (request == NodeRequest::update) {
      const UpdateRequest& u = node_.update();
      UpdateRecord(board, B::kUpdateRecordPage).begin({.server = u.server, .own_id = u.own_id, .path = u.path});
    }
    if (request == NodeRequest::update || request == NodeRequest::restart) board.restart();
  }

  Node node_;
  ApplicationCounters counters_;
  std::uint64_t next_recovery_us_ = 0;
  std::uint32_t samples_ = 0;
  bool started_ = false;
};

// All of an ESC on a board: what is stored, read once at the start.
template <EscBoard B>
class EscFirmware {
 public:
  EscFirmware(B& board, const NodeIdentity& identity) : EscFirmware(ParameterStore(board).load(), identity) {}
  void on_sample(B& board) { control_.on_sample(board); }
  void poll(B& board) { application_.poll(board, control_); }
  EscControl<B>& control() { return control_; }
  EscApplication<>& application() { return application_; }

 private:
  EscFirmware(const StoredParameters& stored, const NodeIdentity& identity)
      : application_(stored.parameters, identity), control_(application_.node().parameters()) {
    application_.node().report_store(stored.state);
  }
  EscApplication<> application_;
  EscControl<B> control_;
};

}  // namespace rotorloop::firmware
