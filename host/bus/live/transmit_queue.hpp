// Frames that the system did not take yet, in the order of arbitration, those of equal identifier in the order in which they came. What
// waited too long is dropped: a set-point that leaves when the bus comes back must not turn a motor. Pure.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>

#include "host/bus/bus_frame.hpp"
#include "protocols/bus_load.hpp"

namespace rotorloop {

class TransmitQueue {
 public:
  static constexpr std::size_t kDepth = 1024;
  static constexpr std::int64_t kStale_ns = 100'000'000;  // beside an ESC's command time-out of 250 ms

  bool empty() const { return waiting_.empty(); }
  std::size_t size() const { return waiting_.size(); }
  // False, and nothing queued, when it is full.
  bool push(const BusFrame& frame, std::int64_t now_ns) {
    if (waiting_.size() >= kDepth) return false;
    waiting_.emplace(key(frame), Entry{.frame = frame, .since_ns = now_ns});
    return true;
  }
  const BusFrame& front() const { return waiting_.begin()->second.frame; }
  void pop() { waiting_.erase(waiting_.begin()); }
  // Returns how many were dropped as stale.
  std::size_t drop_stale(std::int64_t now_ns) {
    return std::erase_if(waiting_, [&](const auto& entry) { return now_ns - entry.second.since_ns > kStale_ns; });
  }
  std::size_t clear() {
    const std::size_t dropped = waiting_.size();
    waiting_.clear();
    return dropped;
  }

 private:
  struct Entry {
    BusFrame frame;
    std::int64_t since_ns = 0;
  };
  static std::uint32_t key(const BusFrame& f) {
    return protocols::arbitration_key(CanFrame{.id = f.id, .extended = f.extended, .length = 0, .data = {}});
  }
  std::multimap<std::uint32_t, Entry> waiting_;  // equal keys keep their order
};

}  // namespace rotorloop
