// The motor side of an ESC: motor control, commissioning and the watch for a hand at the rotor, which take turns in the sample interrupt.
//   control.on_sample(board);                                   sample interrupt
//   app.poll(board, control);                                   main loop: calls all others
#pragma once
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/core/commission/commissioning.hpp"
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/hand_watch.hpp"
#include "firmware/core/motor/motor.hpp"

namespace rotorloop::firmware {

template <Board B>
class EscControl {
 public:
  explicit EscControl(const Parameters& p) : motor_(p), commissioning_(p), watch_(p) {}

  // The sample interrupt.
  void on_sample(B& board) {
    __atomic_store_n(&samples_, samples_ + 1, __ATOMIC_RELAXED);  // no other context writes it
    if (commissioned_ && commissioning_.active()) [[unlikely]]
      commissioning_.on_sample(board);
    else if (!watch_.on_sample(board, motor_.variables()))
      motor_.on_sample(board);
  }

  // Main loop, every poll.
  void set_setpoint(const Setpoint& s) { motor_.set_setpoint(s); }
  Telemetry telemetry() const { return motor_.telemetry(); }
  std::uint32_t samples() const { return __atomic_load_n(&samples_, __ATOMIC_RELAXED); }
  template <class Node>
  requires requires(Node& n) { n.commissioning_order(); }
  void serve(Node& node) {
    // The order has to be renewed while it is followed, and taken back before there can be another one.
    const CommissioningOrder order = node.commissioning_order();
    commissioned_ = commissioned_ || node.commissioning();
    if (commissioned_) {
      if (order.task != CommissioningTask::off && !commissioning_.active()) commissioning_.set_parameters(node.parameters());
      commissioning_.set_order(order);
    }
    node.on_commissioning(commissioning_.result(), B::kSwitchResistance_ohm);
    // The answer before the next question: an answer that is no longer asked for is not kept.
    node.on_hand(watch_.turned());
    watch_.want(node.feels_for_hand());
  }

  Motor<B>& motor() { return motor_; }
  const Motor<B>& motor() const { return motor_; }
  const HandWatch<B>& watch() const { return watch_; }

 private:
  Motor<B> motor_;
  Commissioning<B> commissioning_;
  HandWatch<B> watch_;
  std::uint32_t samples_ = 0;
  bool commissioned_ = false;  // the bus has asked for one since the start
};

}  // namespace rotorloop::firmware
