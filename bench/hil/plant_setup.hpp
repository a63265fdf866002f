// From what the plant file says to the parameters of the plant's parts. No physics here: names and units are matched.
#pragma once
#include <array>
#include <memory>

#include "firmware/core/interface.hpp"
#include "host/vehicle/model.hpp"
#include "sim/airframe/airframe.hpp"
#include "sim/drive/battery.hpp"
#include "sim/drive/drive.hpp"
#include "sim/plant/plant_file.hpp"
#include "sim/rotor/bem.hpp"
#include "sim/sensor/pose.hpp"

namespace rotorloop::bench {

using SharedRotors = std::array<std::shared_ptr<const sim::Rotor>, 4>;

// Reads the blade file of each rotor; rotors with the same file share one prepared geometry. Throws Error.
SharedRotors read_rotors(const sim::PlantFile& plant);
std::array<const sim::Rotor*, 4> pointers(const SharedRotors& rotors);

sim::AirframeConfig airframe_config(const sim::PlantFile& plant, const std::array<const sim::Rotor*, 4>& rotors, std::int64_t step_ns);
sim::DriveParameters drive_parameters(const sim::PlantFile& plant, const sim::Rotor& rotor, int esc);
sim::BatteryParameters battery_parameters(const sim::PlantFile& plant);
sim::PoseConfig pose_config(const sim::PlantFile& plant, bool drift);

// What was written into an ESC when it was set up: the motor's data sheet and the believed propeller (from the vehicle file),
// not the plant's truth about wear or damage.
firmware::Parameters firmware_parameters(const host::VehicleModel& vehicle);

}  // namespace rotorloop::bench
