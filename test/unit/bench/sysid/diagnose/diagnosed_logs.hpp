// Diagnoses of logs of another simulator for tests: half the usual rate, few placebos.
#pragma once
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/sysid/diagnose/diagnose.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "test/unit/bench/sysid/identify/measured_flights.hpp"

namespace rotorloop::diagnose::testing {

inline const std::filesystem::path& vehicles() {
  static const std::filesystem::path folder = std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/measured";
  return folder;
}

inline Diagnosis diagnosed(const std::vector<identify::FlightToFit>& logs, const host::VehicleFile& vehicle, int max_effects) {
  DiagnoseOptions o;
  o.identify.grid.rate_Hz = 50.0;
  o.identify.grid.longest_substep_s = 1e-2;
  o.identify.fit.noise = {.rounds = 16, .tolerance = 0.05, .per_flight = true};
  o.identify.fit.max_iterations = 80;
  o.identify.fit.tolerance = 0.02;
  o.identify.fit.threads = 2;
  o.max_effects = max_effects;
  o.placebos = 30;
  return diagnose({.fitted = logs}, vehicle, o).diagnosis;
}

inline bool names(const AddedEffect& a, const std::string& id) {
  return a.id == id || std::any_of(a.aliases.begin(), a.aliases.end(), [&](const ClassMember& m) { return m.id == id; });
}

}  // namespace rotorloop::diagnose::testing
