// Flight logs as commands take them: read through a mapping, checked before any fit, hashed for the record.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/log/check/checks.hpp"
#include "bench/identify/identify.hpp"
#include "bench/identify/report/identify_result.hpp"

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
  std::vector<identify::InputHash> inputs;

  std::vector<identify::FlightToFit> to_fit() const;
  std::vector<identify::FlightToFit> held_out() const;
  // "sha256:…" of every input that had a part in the fit: what a vehicle file names as its origin.
  std::vector<std::string> fitted_hashes() const;
};

// Throws Error for logs that cannot be read, that the checks refuse, and for a held-out flight that is also fitted.
FlightInputs read_flights(const FlightPaths& paths, const host::VehicleModel& vehicle);

// The terms of these ids. Throws Error (usage) for an unknown or repeated one.
host::TermList term_list(const std::vector<std::string>& ids);

}  // namespace rotorloop::cli
