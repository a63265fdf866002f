#include "host/tools/traffic_table.hpp"

#include <algorithm>

#include "host/bus/frame_bits.hpp"

namespace rotorloop::tools {

void TrafficTable::add(const StampedBusFrame& f) {
  const std::uint32_t key = arbitration_key(CanFrame{.id = f.frame.id, .extended = f.frame.extended, .length = 0, .data = {}});
  TrafficRow& row = rows_[{key, f.frame.fd ? 1u : 0u}];
  if (rows_.size() == 1 && row.frames == 0) first_ns_ = f.time_ns;
  last_ns_ = std::max(last_ns_, f.time_ns);
  if (row.frames == 0) {
    row.first_ns = f.time_ns;
  } else {
    row.longest_gap_ns = std::max(row.longest_gap_ns, f.time_ns - row.last_ns);
  }
  row.last_ns = f.time_ns;
  row.newest = f.frame;
  ++row.frames;
  if (const auto classic = f.frame.classic()) row.bits += static_cast<std::uint64_t>(frame_bits(*classic) + kIntermissionBits);
}

Traffic TrafficTable::traffic() const {
  Traffic t;
  t.first_ns = first_ns_;
  t.last_ns = last_ns_;
  for (const auto& [key, row] : rows_) {
    t.rows.push_back(row);
    t.frames += row.frames;
    t.fd_frames += row.newest.fd ? row.frames : 0;
    t.bits += row.bits;
  }
  return t;
}

double load_percent(const Traffic& t, double bit_rate_Hz) {
  const double span_s = static_cast<double>(t.last_ns - t.first_ns) * 1e-9;
  return span_s > 0.0 ? 100.0 * static_cast<double>(t.bits) / (bit_rate_Hz * span_s) : 0.0;
}

}  // namespace rotorloop::tools
