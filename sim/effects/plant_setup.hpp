// Everything about one simulated vehicle that is fixed before a flight: what the plant file says, and what its effects change
// of it (payload, tilted rotor, late sensor, …). The flight is built from this alone.
#pragma once
#include <array>
#include <cstdint>

#include "sim/airframe/airframe.hpp"
#include "sim/drive/battery.hpp"
#include "sim/drive/drive.hpp"
#include "sim/esc/esc_setup.hpp"
#include "sim/sensor/imu.hpp"
#include "sim/sensor/pose.hpp"

namespace rotorloop::sim {

struct PlantSetup {
  std::uint64_t seed = 1;
  AirframeConfig body;
  std::array<DriveParameters, kAirframeRotors> drive{};
  BatteryParameters battery;
  ImuConfig imu;
  PoseConfig pose;
  std::array<EscSetup, kAirframeRotors> esc{};
};

}  // namespace rotorloop::sim
