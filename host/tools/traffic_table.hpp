// Who sends what how often, and how full that makes a bus: a row for each identifier.
#pragma once
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "host/bus/bus_frame.hpp"

namespace rotorloop::tools {

struct TrafficRow {
  BusFrame newest;
  std::uint64_t frames = 0;
  std::uint64_t bits = 0;  // stuff bits and intermission included; 0 for CAN FD, whose bits have two lengths
  std::int64_t first_ns = 0, last_ns = 0;
  std::int64_t longest_gap_ns = 0;  // between two frames
};

struct Traffic {
  std::vector<TrafficRow> rows;  // in the order of arbitration
  std::uint64_t frames = 0, fd_frames = 0;
  std::uint64_t bits = 0;  // of the classic frames
  std::int64_t first_ns = 0, last_ns = 0;
};

class TrafficTable {
 public:
  void add(const StampedBusFrame& frame);
  Traffic traffic() const;

 private:
  std::map<std::pair<std::uint32_t, std::uint32_t>, TrafficRow> rows_;  // (arbitration key, formats)
  std::int64_t first_ns_ = 0, last_ns_ = 0;
};

// Share of the time between first and last frame that the classic frames need at this bit rate, in percent. 0 for fewer than two frames.
double load_percent(const Traffic& traffic, double bit_rate_Hz);

}  // namespace rotorloop::tools
