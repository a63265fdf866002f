// One node on the virtual bus: its controller's queues and error counters. Users of the bus see PortConfig, ErrorCounters and CanBus.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/base/random.hpp"
#include "host/bus/can_bus.hpp"
#include "sim/world/bus_controller.hpp"
#include "sim/world/bus_fault.hpp"
#include "sim/world/tx_queue.hpp"
#include "sim/world/virtual_time.hpp"

namespace rotorloop::sim {

// Limits of ISO 11898-1:2015 §12.1.4 (fault confinement).
inline constexpr int kPassiveAbove = 127;
inline constexpr int kBusOffAbove = 255;
inline constexpr int kTransmitErrorStep = 8;
inline constexpr int kReceiveAfterPassive = 119;  // REC after a good reception while passive: 119..127 allowed
inline constexpr int kRecoverySequences = 128;    // of 11 recessive bits
inline constexpr int kRecoveryBits = 11;
inline constexpr int kSuspendBits = 8;  // a passive transmitter waits longer after its own frame

struct PortConfig {
  std::string name;                // for messages and reports
  std::size_t tx_depth = 64;       // frames
  std::size_t rx_depth = 256;      // frames
  std::int64_t tx_latency_ns = 0;  // send() to "the controller has it" (a USB adapter: 1-2 ms)
  std::int64_t rx_latency_ns = 0;  // end of frame to "receive() shows it"; the frame's time_ns stays the end of frame
};

struct ErrorCounters {
  int transmit = 0;  // TEC
  int receive = 0;   // REC
};

// A scripted fault of the bus, and how often it has struck.
struct BusFaultState {
  BusFault fault;
  std::uint64_t seen = 0;  // matching frames so far: the sample number of the random choice
  std::uint64_t applied = 0;
  RandomStream random;
};

class VirtualBus;

class VirtualBusPort final : public CanBus {
 public:
  VirtualBusPort(VirtualBus& bus, PortConfig port_config, int port_number)
      : config(std::move(port_config)), number(port_number), tx(config.tx_depth), bus_(bus), rx_(config.rx_depth) {}

  SendStatus send(const CanFrame& frame) override;
  std::optional<StampedFrame> receive() override;
  BusState state() const override { return state_; }
  PortCounters counters() const override { return counted; }

  void take_in(const StampedFrame& frame) {
    if (!wanted(frame.frame.id, frame.frame.extended)) {
      ++counted.filtered;
      return;
    }
    if (rx_count_ == rx_.size()) {
      ++counted.dropped_rx;
      return;
    }
    std::size_t tail = rx_head_ + rx_count_;
    if (tail >= rx_.size()) tail -= rx_.size();
    rx_[tail] = frame;
    ++rx_count_;
    ++counted.received;
  }
  // When receive() shows something that it does not show at time_ns; kNever_ns if nothing waits.
  std::int64_t next_visible_ns(std::int64_t time_ns) const {
    for (std::size_t i = 0; i < rx_count_; ++i) {
      const std::int64_t visible_ns = rx_[(rx_head_ + i) % rx_.size()].time_ns + config.rx_latency_ns;
      if (visible_ns > time_ns) return visible_ns;
    }
    return kNever_ns;
  }

  bool off() const { return state_ == BusState::bus_off; }
  bool passive() const { return controller != nullptr ? controller->passive() : state_ == BusState::error_passive; }
  std::int64_t ready_ns() const { return controller != nullptr ? controller->ready_ns() : tx.earliest_ns(); }
  // With what it takes part in an arbitration; null: with nothing. Stays in `racing` until the end of the frame.
  const TxEntry* enter_arbitration(std::int64_t time_ns) {
    if (controller == nullptr) {
      tx.admit(time_ns);
      return racing = tx.best();
    }
    const CanFrame* frame = controller->offer(time_ns);
    if (frame != nullptr) offered = tx_entry(*frame, controller->ready_ns());
    return racing = frame != nullptr ? &offered : nullptr;
  }
  void count_good_transmission() {
    if (controller != nullptr) return;
    if (errors.transmit > 0) --errors.transmit;
    update_state();
  }
  void count_good_reception() {
    if (errors.receive == 0 || controller != nullptr) return;
    errors.receive = errors.receive > kPassiveAbove ? kReceiveAfterPassive : errors.receive - 1;
    update_state();
  }
  // A passive node that only misses the acknowledge may be alone on the bus: it must not go bus-off for that.
  void count_transmit_error(bool acknowledge_missing) {
    if (controller != nullptr) return;
    if (!(acknowledge_missing && passive())) errors.transmit += kTransmitErrorStep;
    update_state();
  }
  void count_receive_error() {
    if (controller != nullptr) return;
    errors.receive = std::min(errors.receive + 1, kBusOffAbove);
    update_state();
  }
  void restart() {
    errors = {};
    recovery_left = 0;
    state_ = BusState::error_active;
  }

  PortConfig config;
  int number;  // as attach() counted; -1 for the device of an extra_traffic fault
  TxQueue tx;
  PortCounters counted;
  ErrorCounters errors;
  int recovery_left = 0;  // sequences of recessive bits until a bus-off node returns
  std::int64_t suspended_until_ns = 0;
  const TxEntry* racing = nullptr;
  // Of a node that is modelled elsewhere only: queues, counters and bus-off are its own.
  BusController* controller = nullptr;
  TxEntry offered;
  // Of an extra_traffic device only:
  BusFaultState* traffic = nullptr;
  std::uint64_t traffic_count = 0;
  std::int64_t traffic_due_ns = 0;

 private:
  void update_state() {
    if (errors.transmit > kBusOffAbove) {
      state_ = BusState::bus_off;
      recovery_left = kRecoverySequences;
    } else {
      state_ = errors.transmit > kPassiveAbove || errors.receive > kPassiveAbove ? BusState::error_passive : BusState::error_active;
    }
  }

  VirtualBus& bus_;
  std::vector<StampedFrame> rx_;  // ring
  std::size_t rx_head_ = 0;
  std::size_t rx_count_ = 0;
  BusState state_ = BusState::error_active;
};

}  // namespace rotorloop::sim
