// A Betaflight configuration made from the vehicle file: gains by reasoning from inertia, arms and thrust, not by trying flights.
#pragma once
#include <string>

#include "host/vehicle/model.hpp"

namespace rotorloop::hil {

// How motor outputs 0 to 1 become rotor speeds, and sticks become wishes; used by the configuration and by the bridge.
struct BetaflightMap {
  double omega_min_rad_s = 0.0, omega_max_rad_s = 0.0;  // at output 0 and 1: speed follows output in a straight line
  double hover_omega_rad_s = 0.0;

  double omega_rad_s(double output) const { return omega_min_rad_s + output * (omega_max_rad_s - omega_min_rad_s); }
  double output(double omega) const { return (omega - omega_min_rad_s) / (omega_max_rad_s - omega_min_rad_s); }
};

inline constexpr double kAngleLimit_deg = 60.0;        // tilt at full stick
inline constexpr double kFullStickRate_deg_s = 200.0;  // yaw
inline constexpr int kMinCheck_us = 1050;              // throttle stick below it is none
inline constexpr double kMotorIdle = 0.055;            // of the output, when armed

// Lines of Betaflight's command line, ending with `save`.
std::string betaflight_config(const host::VehicleModel& vehicle, const BetaflightMap& map);

}  // namespace rotorloop::hil
