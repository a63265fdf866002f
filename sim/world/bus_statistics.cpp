// Window sums are kept in integer nanoseconds: a load is the same number on every machine.
#include "sim/world/bus_statistics.hpp"

#include <algorithm>

#include "host/bus/frame_bits.hpp"

namespace rotorloop::sim {

LoadMeter::LoadMeter(std::int64_t start_ns, std::int64_t window_ns, std::size_t stored_windows)
    : window_ns_(window_ns),
      window_end_ns_(start_ns + window_ns),
      last_from_ns_(start_ns),
      last_to_ns_(start_ns),
      capacity_(stored_windows) {
  windows_.reserve(stored_windows);
}

void LoadMeter::close_window() {
  const double percent = 100.0 * static_cast<double>(window_busy_ns_) / static_cast<double>(window_ns_);
  max_percent_ = std::max(max_percent_, percent);
  if (windows_.size() < capacity_) windows_.push_back(static_cast<float>(percent));
  window_end_ns_ += window_ns_;
  // What the last stretch still covers of the new window.
  const std::int64_t begin_ns = window_end_ns_ - window_ns_;
  window_busy_ns_ = std::clamp(last_to_ns_ - begin_ns, std::int64_t{0}, window_ns_);
}

void LoadMeter::add_busy(std::int64_t from_ns, std::int64_t to_ns) {
  advance_to(from_ns);
  window_busy_ns_ += std::min(to_ns, window_end_ns_) - std::min(from_ns, window_end_ns_);
  total_busy_ns_ += to_ns - from_ns;
  last_from_ns_ = from_ns;
  last_to_ns_ = to_ns;
}

void LoadMeter::advance_to(std::int64_t time_ns) {
  while (window_end_ns_ <= time_ns) close_window();
}

std::int64_t LoadMeter::busy_until_ns(std::int64_t time_ns) const {
  return total_busy_ns_ - std::max(std::int64_t{0}, last_to_ns_ - std::max(time_ns, last_from_ns_));
}

IdTable::IdTable(std::size_t capacity_power_of_two) : slots_(capacity_power_of_two) {}

IdStatistics* IdTable::find_or_add(std::uint32_t id, bool extended) {
  const std::uint32_t hash = (id ^ (extended ? 0x80000000u : 0u)) * 0x9E3779B1u;
  std::size_t at = (hash >> 16) & (slots_.size() - 1);
  while (slots_[at].frames != 0) {
    if (slots_[at].id == id && slots_[at].extended == extended) return &slots_[at];
    at = (at + 1) & (slots_.size() - 1);
  }
  if (used_ + 1 >= slots_.size()) return nullptr;  // one slot stays free, it ends every search
  ++used_;
  slots_[at].id = id;
  slots_[at].extended = extended;
  return &slots_[at];
}

std::vector<IdStatistics> IdTable::rows() const {
  std::vector<IdStatistics> rows;
  std::copy_if(slots_.begin(), slots_.end(), std::back_inserter(rows), [](const IdStatistics& s) { return s.frames != 0; });
  const auto key = [](const IdStatistics& s) { return arbitration_key(CanFrame{.id = s.id, .extended = s.extended}); };
  std::sort(rows.begin(), rows.end(), [&](const IdStatistics& a, const IdStatistics& b) { return key(a) < key(b); });
  return rows;
}

}  // namespace rotorloop::sim
