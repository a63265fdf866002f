// Small logs and mappings for tests of the readers: a mapping is a line of text away, a log two rows long.
#pragma once
#include <string>

#include "bench/sysid/log/read_flight.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::log {

// A CSV mapping with time column t in s, and what a test adds.
inline std::string csv_mapping(const std::string& streams, const std::string& head = "") {
  return "format = 1\nname = \"test\"\nlog = \"csv\"\n" + head + "[time]\ncolumn = \"t\"\nunit = \"s\"\n" + streams;
}

// A stream of one quantity: the keys that all need, and more lines.
inline std::string stream(const std::string& quantity, const std::string& columns, const std::string& unit, const std::string& more = "") {
  return "[[stream]]\nquantity = \"" + quantity + "\"\ncolumns = " + columns + "\n" + (unit.empty() ? "" : "unit = \"" + unit + "\"\n") +
         more + "\n";
}

struct ReadBack {
  FlightRecord flight;
  std::vector<LogFinding> notes;
  bool noted(const std::string& text) const {
    for (const auto& n : notes)
      if ((n.stream + ": " + n.what).find(text) != std::string::npos) return true;
    return false;
  }
};

inline ReadBack read_csv(const test::TempFolder& folder, const std::string& log, const std::string& mapping) {
  const auto path = folder.write("log.csv", log);
  const LogMapping m = read_log_mapping(folder.write("test.mapping.toml", mapping));
  ReadBack out;
  out.flight = read_flight(path, &m, &out.notes);
  return out;
}

}  // namespace rotorloop::log
