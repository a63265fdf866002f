// Joins buses: what comes in on one goes out on all others, unchanged. Two bridges between the same two buses make a ring in which a
// frame never ends, and a bus that repeats its own frames to the bridge does too; the bridge cannot see that.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "host/bus/timed_bus.hpp"

namespace rotorloop::tools {

struct BridgeCounters {
  std::uint64_t taken = 0;    // frames received from this bus
  std::uint64_t given = 0;    // frames sent to this bus
  std::uint64_t refused = 0;  // frames that this bus did not take (queue full, nobody connected)
};

class Bridge {
 public:
  using Tap = std::function<void(std::size_t bus, const StampedBusFrame&)>;

  // The buses must outlive the bridge. `tap` sees every frame with the number of the bus it came from.
  explicit Bridge(std::vector<TimedBus*> buses, Tap tap = {}) : buses_(std::move(buses)), tap_(std::move(tap)), counters_(buses_.size()) {}

  // Forwards what waits, at most `limit` frames, one of each bus in turn. Returns how many.
  std::size_t forward(std::size_t limit = 1000);
  std::span<const BridgeCounters> counters() const { return counters_; }
  std::span<TimedBus* const> buses() const { return buses_; }

 private:
  std::vector<TimedBus*> buses_;
  Tap tap_;
  std::vector<BridgeCounters> counters_;
};

}  // namespace rotorloop::tools
