// A flight of a few seconds with the shipped vehicle, for tests that look into the loop: climb by one metre while moving by two.
#pragma once
#include <filesystem>
#include <memory>

#include "bench/hil/flight/loop.hpp"
#include "host/control/gains_file.hpp"
#include "host/control/trajectory_generator.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "sim/plant/assemble.hpp"

namespace rotorloop::test {

inline std::filesystem::path shipped(const char* path) { return std::filesystem::path(ROTORLOOP_SOURCE_DIR) / path; }

// Read once for a test binary: the polars take most of a second.
struct ShippedVehicle {
  sim::PlantFile plant = sim::read_plant(shipped("vehicles/reference_plant.toml"));
  sim::SharedRotors rotors = sim::read_rotors(plant);
  host::VehicleModel model = host::to_model(host::read_vehicle(shipped("vehicles/calibrated.toml"), host::builtin_effect_catalogue()));
  host::GainsFile gains = host::read_gains(shipped("vehicles/gains.toml"));
};
inline const ShippedVehicle& shipped_vehicle() {
  static const ShippedVehicle vehicle;
  return vehicle;
}

// Starts at 2 s of virtual time (FlightComputerConfig::start_us), moves for 2 s.
inline const host::Trajectory& short_trajectory() {
  static const host::Trajectory trajectory =
      host::join({host::hover({0.0, 0.0, 2.0}, 0.0, 0.5), host::rest_to_rest({{0.0, 0.0, 2.0}, 0.0, 0.0}, {{2.0, 0.0, 3.0}, 0.5, 2.0}),
                  host::hover({2.0, 0.0, 3.0}, 0.5, 0.5)});
  return trajectory;
}
inline constexpr double kShortFlightEnd_s = 2.0 + 3.0;

inline hil::LoopConfig short_flight_config(std::uint64_t seed) {
  hil::LoopConfig config;
  config.seed = seed;
  return config;
}

inline std::unique_ptr<host::FlightController> shipped_controller() {
  const ShippedVehicle& v = shipped_vehicle();
  return std::make_unique<host::CascadeController>(v.model, host::controller_config(v.gains, host::Variant::pd_ff_thrust_drag));
}

inline std::unique_ptr<hil::Loop> short_flight(const hil::LoopConfig& config) {
  const ShippedVehicle& v = shipped_vehicle();
  return std::make_unique<hil::Loop>(v.plant, sim::pointers(v.rotors), v.model, short_trajectory(), shipped_controller(), config);
}

inline void fly_until(hil::Loop& loop, double time_s) {
  while (loop.now_s() < time_s && loop.computer().phase() != host::FlightPhase::safe && !loop.airframe().ended()) loop.tick();
}

}  // namespace rotorloop::test
