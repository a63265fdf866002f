// The flights of the data folder through the shipped mapping and vehicle files, for tests that judge real logs.
#pragma once
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/sysid/log/read_flight.hpp"
#include "host/vehicle/effect_catalogue.hpp"
#include "host/vehicle/model.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::identify::testing {

// Empty when ROTORLOOP_DATA is not set.
inline std::filesystem::path measured_flights() {
  const char* root = std::getenv("ROTORLOOP_DATA");
  return root ? std::filesystem::path(root) / "flights" : std::filesystem::path();
}

struct MeasuredFlight {
  log::FlightRecord record;
  host::VehicleModel vehicle;
};

// A log in a set's folder.
inline MeasuredFlight read_measured(const std::filesystem::path& file) {
  const std::filesystem::path source = ROTORLOOP_SOURCE_DIR;
  const std::string set = file.parent_path().filename().string();
  const log::LogMapping mapping = log::read_log_mapping(source / "vehicles/measured" / (set + ".mapping.toml"));
  const host::EffectCatalogue effects = host::read_effect_catalogue(source / "effects/catalogue.toml");
  return {log::read_flight(file, &mapping), host::to_model(host::read_vehicle(source / "vehicles/measured" / (set + ".toml"), effects))};
}

inline std::vector<std::filesystem::path> flights_of(const std::string& set) {
  std::vector<std::filesystem::path> out;
  for (const auto& e : std::filesystem::directory_iterator(measured_flights() / set)) {
    const std::string name = e.path().filename().string();
    if (e.path().extension() == ".csv" && !name.ends_with("_mocap.csv")) out.push_back(e.path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace rotorloop::identify::testing
