// Flight logs as commands take them: read through a mapping, checked before any fit, hashed for the record.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/sysid/identify/identify.hpp"
#include "bench/sysid/identify/report/identify_result.hpp"
#include "bench/sysid/log/check/checks.hpp"

namespace rotorloop::cli {

struct FlightPaths {
  std::filesystem::path mapping;
  std::vector<std::filesystem::path> vertical, horizontal, rotation, flights, held_out;
  bool checks = true;
  bool quiet = false;  // no findings on stderr
};

struct FlightInputs {
  std::vector<identify::FlightToFit> flights;  // those of the fit, then those held out
  std::size_t fitted = 0;
  std::vector<log::CheckedFlight> checked;  // in the same order; empty without checks
  std::vector<log::CheckedFlight> refused;  // by the checks, and left out because others remain
  std::vector<identify::InputHash> inputs;  // of flights that were taken

  std::vector<identify::FlightToFit> to_fit() const;
  std::vector<identify::FlightToFit> held_out() const;
  // Both, as a record of the checks has them.
  std::vector<log::CheckedFlight> all_checked() const;
  // "sha256:…" of every input that had a part in the fit: what a vehicle file names as its origin.
  std::vector<std::string> fitted_hashes() const;
};

// A flight that the checks refuse is left out with a warning on stderr. Throws Error for logs that cannot be read, where the checks refuse
// every flight of the fit (of the first), and for a held-out flight that is also fitted.
FlightInputs read_flights(const FlightPaths& paths, const host::VehicleModel& vehicle);

// The terms of these ids. Throws Error (usage) for an unknown or repeated one.
host::TermList term_list(const std::vector<std::string>& ids);

}  // namespace rotorloop::cli
