// The CAN bus of the simulated world: nodes attach and get a port that implements host/bus/can_bus.hpp, and frames take the
// time that their stuffed bits need, after the arbitration of ISO 11898-1, with error counters, bus-off and scripted faults.
//
// Time. A port's send() has no time argument: the frame counts as sent at the bus's `now`, which advance_to() or set_now()
// sets. advance_to(t) does everything that happens up to and including t, with one exception: an arbitration that would begin
// at exactly t stays open until the next call, because other nodes may still send at t. So the order in which the caller lets
// nodes send at one instant does not matter, and a frame sent at t never wins an arbitration that began before t.
// set_now(t) only moves the stamp of later send() and receive() calls; it may go back, but not before the last advance_to().
//
// Simplifications, all on the safe (longer) side or without effect on data frames: no propagation delay and no sampling jitter;
// an error frame always takes 6 + 6 flag bits and 8 delimiter bits; REC rises by 1 per error; no overload frames.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/bus/can_bus.hpp"
#include "sim/world/bus_fault.hpp"
#include "sim/world/bus_statistics.hpp"
#include "sim/world/tx_queue.hpp"
#include "sim/world/virtual_bus_port.hpp"
#include "sim/world/virtual_time.hpp"

namespace rotorloop::sim {

struct BusConfig {
  std::int64_t bit_rate_Hz = 1'000'000;  // has to divide 1 GHz
  // Ablation "the bus replaced by a direct call": send() delivers at once, no arbitration, no bus time, no error counters.
  // Of the faults only lose_sent, lose_received, silent and unplugged have a meaning then; others are refused.
  bool ideal = false;
  std::uint64_t seed = 0;  // of the faults' random choices
  std::int64_t start_ns = 0;
  bool recover_from_bus_off = true;  // after 128 x 11 recessive bits; false: off for good
  std::int64_t load_window_ns = 10 * kNs_per_ms;
  std::size_t stored_load_windows = 12'000;
  std::vector<BusFault> faults{};
};

// What a recorder sees: every frame that occupied the bus.
struct BusEvent {
  CanFrame frame;
  std::int64_t start_ns = 0;  // start of frame
  std::int64_t end_ns = 0;    // end of frame; of the error delimiter when destroyed
  int port = -1;              // sender; -1 for the device of an extra_traffic fault
  bool error = false;         // destroyed by an error frame, will be sent again
};

class VirtualBus {
 public:
  explicit VirtualBus(BusConfig config);  // throws Error on an impossible bit rate, window or fault
  ~VirtualBus();
  VirtualBus(const VirtualBus&) = delete;
  VirtualBus& operator=(const VirtualBus&) = delete;

  // Ports are numbered 0, 1, … in this order; the reference lives as long as the bus. Throws Error after the first advance_to().
  CanBus& attach(PortConfig config);

  // A node that is modelled elsewhere and outlives the bus; it calls `has_frame` when it gets something to send.
  void attach(BusController& controller, std::string name);
  void has_frame(std::int64_t since_ns) {
    if (!in_flight_) wake_ns_ = std::min(wake_ns_, std::max(idle_from_ns_, since_ns) + 1);
  }
  std::int64_t bit_ns() const { return bit_ns_; }

  void advance_to(std::int64_t time_ns) {
    if (time_ns < wake_ns_ && time_ns >= processed_ns_) {
      now_ns_ = processed_ns_ = time_ns;
      return;
    }
    process(time_ns);
  }
  void set_now(std::int64_t time_ns);
  std::int64_t now_ns() const { return now_ns_; }

  // The earliest time (after the last advance_to()) at which advance_to() can change what a port sees, provided that nobody
  // sends before; kNever_ns when nothing is under way. A lower bound: the caller may come too early, never too late.
  std::int64_t next_event_ns() const;

  std::size_t port_count() const { return port_count_; }
  const std::string& port_name(std::size_t port) const;
  CanBus& port(std::size_t port);
  ErrorCounters error_counters(std::size_t port) const;

  // Called for every frame at its end of frame, in bus order; set before the run. Costs no allocation.
  void set_tap(std::function<void(const BusEvent&)> tap) { tap_ = std::move(tap); }

  BusStatistics statistics();                       // up to the last advance_to(); allocates, not for the loop
  std::span<const float> load_by_window_percent();  // complete windows

 private:
  friend class VirtualBusPort;
  using Port = VirtualBusPort;
  using FaultState = BusFaultState;

  struct Flight {  // the frame on the wire
    TxEntry entry;
    std::int64_t start_ns = 0;
    std::int64_t end_ns = 0;
    std::uint64_t senders = 0;  // bit per node
    bool error = false;
    bool ack_error = false;
  };

  void seal();
  void process(std::int64_t time_ns);
  SendStatus send(Port& port, const CanFrame& frame);
  void send_ideal(Port& port, const CanFrame& frame);
  std::int64_t next_start_ns() const;
  void start(std::int64_t time_ns);
  void finish();
  void finish_well();
  void finish_with_error();
  void deliver(const StampedFrame& stamped, std::uint64_t senders);
  void count_delivery(const TxEntry& entry, std::int64_t start_ns, std::int64_t end_ns);
  bool restart_recovered(std::int64_t time_ns);
  std::int64_t recovered_at_ns(const Port& node) const;
  void refill(Port& device, std::int64_t not_before_ns);
  void update_wake();
  bool muted(const Port& port, std::int64_t time_ns) const;
  bool unplugged(const Port& port, std::int64_t time_ns) const;
  bool acknowledges(const Port& port, std::int64_t time_ns) const;
  bool strikes(FaultState& state, const CanFrame& frame, std::int64_t time_ns);
  bool out_of_time(const Port& port, bool sends) const;
  void tell_controllers();
  int error_bit(FaultState& state, int frame_bits) const;

  std::int64_t bits_ns(std::int64_t bits) const { return bits * bit_ns_; }

  BusConfig config_;
  std::int64_t bit_ns_;
  std::int64_t now_ns_;
  std::int64_t processed_ns_;         // everything up to here has happened
  std::int64_t idle_from_ns_;         // end of the last intermission
  std::int64_t wake_ns_ = kNever_ns;  // before it, advance_to() has nothing to do
  bool sealed_ = false;
  bool in_flight_ = false;
  Flight flight_;
  std::vector<std::unique_ptr<Port>> nodes_;  // ports, then the devices of extra_traffic faults
  std::size_t port_count_ = 0;
  std::vector<FaultState> faults_;
  std::function<void(const BusEvent&)> tap_;
  LoadMeter load_;
  IdTable ids_;
  std::uint64_t frames_ = 0;
  std::uint64_t error_frames_ = 0;
  std::uint64_t id_collisions_ = 0;
  std::uint64_t lost_by_fault_ = 0;
  std::uint64_t missed_while_off_ = 0;
  std::uint64_t ids_not_counted_ = 0;
  std::int64_t worst_wait_ns_ = 0;
};

}  // namespace rotorloop::sim
