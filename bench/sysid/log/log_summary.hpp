// What is in a flight, at a glance: streams, rates, spans, first values. For `rotorloop log info` and for people who write a mapping.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::log {

struct StreamSummary {
  std::string name, unit;  // "gyro_B", "rad/s"
  std::size_t samples = 0;
  double from_s = 0.0, to_s = 0.0;
  double rate_Hz = 0.0;  // 1 / median step; 0 with fewer than two samples
  double longest_gap_s = 0.0;
  std::vector<double> first;  // first value, components in order
};

// Streams that the record has, in a fixed order, extras last.
std::vector<StreamSummary> summarize(const FlightRecord& flight);

// A table, or one JSON document: {"format", "flight", "source", "streams": […], "notes": […]}. Numbers that are none are null.
std::string summary_text(const FlightRecord& flight, std::span<const LogFinding> notes);
std::string summary_json(const FlightRecord& flight, std::span<const LogFinding> notes);

}  // namespace rotorloop::log
