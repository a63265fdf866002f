// What the tests on measured flights share: flights and vehicles of a set by name, and the whole identification with few words.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "bench/sysid/identify/identify.hpp"
#include "bench/sysid/log/read_flight.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::identify {

struct MeasuredSet {
  std::string name;

  static bool present() { return std::getenv("ROTORLOOP_DATA") != nullptr; }
  std::filesystem::path folder() const { return std::filesystem::path(std::getenv("ROTORLOOP_DATA")) / "flights" / name; }
  static std::filesystem::path shipped() { return std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/measured"; }
  host::VehicleFile vehicle() const { return host::read_vehicle(shipped() / (name + ".toml"), host::builtin_effect_catalogue()); }
  log::FlightRecord flight(const std::string& stem) const {
    const log::LogMapping mapping = log::read_log_mapping(shipped() / (name + ".mapping.toml"));
    return log::read_flight(folder() / (stem + ".csv"), &mapping);
  }
  std::vector<log::FlightRecord> flights(const std::vector<std::string>& stems) const {
    std::vector<log::FlightRecord> out;
    for (const std::string& stem : stems) out.push_back(flight(stem));
    return out;
  }
};

inline std::vector<FlightToFit> without_roles(const std::vector<log::FlightRecord>& records) {
  std::vector<FlightToFit> out;
  for (const log::FlightRecord& r : records) out.push_back({.record = r, .role = FlightRole::any, .segments = {}});
  return out;
}

}  // namespace rotorloop::identify
