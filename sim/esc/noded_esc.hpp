// An ESC on a bus: any ESC of this folder with the main loop of the firmware (firmware/app) and a bus port. The main loop comes round at
// 4 kHz, every sixth current-loop period.
#pragma once
#include <concepts>
#include <cstdint>
#include <optional>
#include <utility>

#include "firmware/app/esc_application.hpp"
#include "firmware/core/interface.hpp"
#include "host/base/random.hpp"
#include "host/bus/can_bus.hpp"
#include "sim/esc/esc_setup.hpp"
#include "sim/esc/simulated_board.hpp"

namespace rotorloop::sim {

template <class N>
concept BusNode = requires(N n, const CanFrame& frame, std::int64_t time_us, const firmware::Telemetry& telemetry) {
  n.on_frame(frame, time_us);
  n.poll(time_us, telemetry);
  { n.next_frame() } -> std::same_as<std::optional<CanFrame>>;
  { n.setpoint(time_us) } -> std::convertible_to<firmware::Setpoint>;
};

template <class Esc, BusNode Node, class Flash = firmware::MemoryFlash>
class NodedEsc {
 public:
  static constexpr std::uint64_t kPeriodsPerPoll = 6;

  // `setup`: defects between node and motor control; `noise` is drawn from only when the setup has speed noise.
  NodedEsc(Esc esc, const Node& node, CanBus& port, const EscSetup& setup = {}, RandomStream noise = {0, 0}, Flash pages = {})
      : esc_(std::move(esc)), application_(node), board_(port, setup.report_delay_ns / 1000, pages), setup_(setup), noise_(noise) {}

  // One 24 kHz period.
  void step_current_loop() {
    run_node();
    esc_.step_current_loop();
  }
  // The node's share of a period alone, for a caller that steps several ESCs together afterwards.
  void run_node() {
    if (period_++ % kPeriodsPerPoll != 0) return;
    board_.advance_to(esc_.time_us());
    Control control{*this};
    application_.poll(board_, control);
  }
  Esc& esc() { return esc_; }
  const Esc& esc() const { return esc_; }
  Node& node() { return application_.node(); }
  const Node& node() const { return application_.node(); }
  SimulatedBoard<Flash>& board() { return board_; }
  const SimulatedBoard<Flash>& board() const { return board_; }
  // The application starts anew, as after a reset of the processor.
  void start(const Node& node, firmware::ResetCause cause) {
    application_ = firmware::EscApplication<Node>(node);
    board_.started_by(cause);
  }

 private:
  // The motor side with the defects of the setup.
  struct Control {
    NodedEsc& e;
    void set_setpoint(firmware::Setpoint wanted) {
      // What the box takes for the wanted speed is another one in truth.
      if (wanted.mode == firmware::Mode::speed) wanted.value = static_cast<float>(static_cast<double>(wanted.value) / e.setup_.speed_scale);
      e.esc_.set_setpoint(wanted);
    }
    firmware::Telemetry telemetry() const {
      firmware::Telemetry t = e.esc_.telemetry();
      if (e.setup_.speed_scale != 1.0) t.speed_rad_s = static_cast<float>(static_cast<double>(t.speed_rad_s) * e.setup_.speed_scale);
      if (e.setup_.speed_noise_rad_s > 0.0 && t.speed_valid)
        t.speed_rad_s += static_cast<float>(e.setup_.speed_noise_rad_s * e.noise_.gaussian(e.period_));
      return t;
    }
    void serve(Node& node) {
      if constexpr (requires { e.esc_.control().serve(node); }) e.esc_.control().serve(node);
    }
    std::uint32_t samples() const {
      if constexpr (requires { e.esc_.control(); }) return e.esc_.control().samples();
      return static_cast<std::uint32_t>(e.period_);
    }
  };

  Esc esc_;
  firmware::EscApplication<Node> application_;
  SimulatedBoard<Flash> board_;
  EscSetup setup_;
  RandomStream noise_;
  std::uint64_t period_ = 0;
};

}  // namespace rotorloop::sim
