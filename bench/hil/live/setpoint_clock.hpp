// Time for an ESC whose flight is in lockstep over a bus: each set-point of the fast channel lets it go on by 1 ms, and the feedback that
// answers it leaves when that time has passed, after whatever else the ESC said meanwhile. So nothing of a flight depends on how busy the
// machine is. Before the first set-point, and after a silence of them, its time is that of the bus: its own time-outs then stop the motor.
#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>

#include "host/bus/timed_bus.hpp"

namespace rotorloop::live {

class SetpointClock final : public TimedBus {
 public:
  static constexpr std::int64_t kStep_ns = 1'000'000;  // set-points come at 1 kHz

  // For an ESC of this group (esc_index / 4). `bus` outlives it.
  SetpointClock(TimedBus& bus, std::uint8_t group, std::int64_t silence_ns);

  // Takes frames up to the next set-point; true when time went on: then the ESC is to be moved on to now_ns() and end_step() called.
  bool begin_step();
  void end_step();
  // In lockstep: nothing happens before the next frame, or before this time of the bus.
  std::int64_t next_ns() const { return stepped_ ? bus_.now_ns() + silence_ns_ / 4 : bus_.now_ns() + kStep_ns; }
  // Time that no set-point gave: what an ESC does that hears nothing more.
  void run_on(std::int64_t ns) { now_ns_ += ns; }
  std::uint64_t steps() const { return steps_; }

  SendStatus send_any(const BusFrame& frame) override;
  std::optional<StampedBusFrame> receive_any() override;
  std::int64_t now_ns() const override { return now_ns_; }
  void wait_until(std::int64_t) override { bus_.wait_until(next_ns()); }
  BusState state() const override { return bus_.state(); }
  PortCounters counters() const override { return bus_.counters(); }
  bool set_filters(std::span<const CanFilter> filters) override { return bus_.set_filters(filters); }
  std::string name() const override { return bus_.name(); }

 private:
  TimedBus& bus_;
  std::uint8_t group_;
  std::int64_t silence_ns_;
  std::int64_t now_ns_, heard_ns_, looked_ns_;  // own time; of the bus: the newest set-point, the last look
  bool stepped_ = false;                        // by set-points
  std::uint64_t steps_ = 0;
  std::deque<StampedBusFrame> arrived_;
  std::optional<BusFrame> answer_;
};

}  // namespace rotorloop::live
