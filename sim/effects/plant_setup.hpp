// Everything about one simulated vehicle that is fixed before a flight: what the plant file says, and what its effects change
// of it (payload, tilted rotor, late sensor, …). The flight is built from this alone.
#pragma once
#include <array>
#include <cstdint>

#include "sim/airframe/airframe.hpp"
#include "sim/drive/battery.hpp"
#include "sim/drive/drive.hpp"
#include "sim/sensor/imu.hpp"
#include "sim/sensor/pose.hpp"

namespace rotorloop::sim {

// What is wrong with one ESC as a box: its firmware does not know.
struct EscSetup {
  double speed_scale = 1.0;          // speed that it reports and holds, over the true one
  double speed_noise_rad_s = 0.0;    // on the reported speed, standard deviation of each report
  std::int64_t report_delay_ns = 0;  // of all frames that it sends
  double lag_s = 0.0;                // above 0: speed follows the command as a first-order lag, in place of firmware and motor
};

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
