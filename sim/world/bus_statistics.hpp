// What the virtual bus measured: load by windows and in all, waiting times, a row per identifier. Load counts every bit that
// keeps the bus from others: frames with their stuff bits, error frames, intermission.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace rotorloop::sim {

struct IdStatistics {
  std::uint32_t id = 0;
  bool extended = false;
  std::uint64_t frames = 0;
  std::uint64_t bus_bits = 0;          // intermission included
  std::int64_t worst_wait_ns = 0;      // from send() (plus the port's latency) to the start of the frame that succeeded
  std::int64_t worst_response_ns = 0;  // from the same moment to the end of frame
};

struct BusStatistics {
  std::int64_t elapsed_ns = 0;
  std::int64_t busy_ns = 0;
  double mean_load_percent = 0.0;
  double max_load_percent = 0.0;  // fullest complete window
  std::uint64_t frames = 0;       // that ended well
  std::uint64_t error_frames = 0;
  std::uint64_t id_collisions = 0;     // two ports sent the same identifier at once
  std::uint64_t lost_by_fault = 0;     // receptions that a BusFault took away
  std::uint64_t missed_while_off = 0;  // receptions by nodes that were bus-off
  std::uint64_t ids_not_counted = 0;   // frames of identifiers beyond the table's capacity
  std::int64_t worst_wait_ns = 0;
  std::vector<IdStatistics> ids;  // ascending arbitration order
};

// Adds up busy stretches into windows of equal length. Stretches come in order of time.
class LoadMeter {
 public:
  LoadMeter(std::int64_t start_ns, std::int64_t window_ns, std::size_t stored_windows);
  void add_busy(std::int64_t from_ns, std::int64_t to_ns);
  void advance_to(std::int64_t time_ns);                   // closes windows that ended by then
  std::int64_t busy_until_ns(std::int64_t time_ns) const;  // busy time before time_ns, for time_ns not before the last stretch's start
  double max_load_percent() const { return max_percent_; }
  std::span<const float> window_load_percent() const { return windows_; }  // the first `stored_windows` complete ones

 private:
  void close_window();
  std::int64_t window_ns_;
  std::int64_t window_end_ns_;
  std::int64_t window_busy_ns_ = 0;
  std::int64_t total_busy_ns_ = 0;  // of [start, last stretch), the last stretch counted whole
  std::int64_t last_from_ns_ = 0;
  std::int64_t last_to_ns_ = 0;
  double max_percent_ = 0.0;
  std::size_t capacity_;
  std::vector<float> windows_;
};

// Counts by identifier in a fixed open-addressing table, so that the count costs no allocation.
class IdTable {
 public:
  explicit IdTable(std::size_t capacity_power_of_two);
  // nullptr when the table is full.
  IdStatistics* find_or_add(std::uint32_t id, bool extended);
  std::vector<IdStatistics> rows() const;

 private:
  std::vector<IdStatistics> slots_;  // frames == 0: free
  std::size_t used_ = 0;
};

}  // namespace rotorloop::sim
