// The flights of a fit as their files name them: read through a mapping, checked before any fit, hashed for the record.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/log/check/checks.hpp"

namespace rotorloop::log {

enum class FlightRole { any, vertical, horizontal, rotation };  // the stage that a flight was flown for

struct FlightToFit {
  FlightRecord record;  // only what may be fitted
  FlightRole role = FlightRole::any;
  std::vector<TimeRange> segments;                   // no step of the model crosses from one to the next; empty: one
  std::optional<double> pose_late_s = std::nullopt;  // first guess of how much later than the moment shown a pose is stamped
};

struct FlightPaths {
  std::filesystem::path mapping = {};                                                // of logs of other tools; empty: own logs
  std::vector<std::filesystem::path> vertical = {}, horizontal = {}, rotation = {};  // of the fit, each flown for its stage
  std::vector<std::filesystem::path> flights = {};                                   // of the fit
  std::vector<std::filesystem::path> held_out = {};                                  // have no part in the fit
  bool checks = true;                                                                // false: whatever is in the logs is fitted
};

struct InputHash {
  std::string path, sha256;
  bool held_out = false;  // had no part in what came of the others
};

struct FlightSet {
  std::vector<FlightToFit> flights;    // those of the fit, then those held out
  std::size_t fitted = 0;              // of them
  std::vector<CheckedFlight> checked;  // in the same order; empty without checks
  std::vector<CheckedFlight> refused;  // by the checks, and left out because others remain
  std::vector<InputHash> inputs;       // mapping and flights that were taken

  std::vector<FlightToFit> to_fit() const;
  std::vector<FlightToFit> held_out() const;
  // Both, as a record of the checks has them.
  std::vector<CheckedFlight> all_checked() const;
  // "sha256:…" of every input that had a part in the fit: what a vehicle file names as its origin.
  std::vector<std::string> fitted_hashes() const;
};

// Called while flights are read, for a caller that shows what the checks find.
struct ReadingWatch {
  std::function<void(const CheckedFlight&)> checked = {};  // each flight with findings, also one that is refused
  std::function<void(const FlightSet&)> read = {};         // once, with all that were taken and those left out
};

// A flight that the checks refuse is left out (`refused`). Throws Error for logs that cannot be read, where the checks refuse every flight
// of the fit (of the first), for a held-out flight that is also fitted, and where no flight is named.
FlightSet read_flight_set(const FlightPaths& paths, const host::VehicleModel& vehicle, const ReadingWatch& watch = {});

}  // namespace rotorloop::log
