// A Betaflight configuration made from the vehicle file: gains by reasoning from inertia, arms and thrust, not by trying flights.
#pragma once
#include <string>

#include "bench/hil/controllers/motor_map.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::hil {

inline constexpr int kMinCheck_us = 1050;    // throttle stick below it is none
inline constexpr double kMotorIdle = 0.055;  // of the output, when armed

// Lines of Betaflight's command line, ending with `save`.
std::string betaflight_config(const host::VehicleModel& vehicle, const MotorMap& map);

}  // namespace rotorloop::hil
