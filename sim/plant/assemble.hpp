// From what the plant file says to the parameters of the plant's parts. No physics here: names and units are matched.
#pragma once
#include <array>
#include <cstdint>
#include <memory>

#include "sim/airframe/airframe.hpp"
#include "sim/drive/battery.hpp"
#include "sim/drive/drive.hpp"
#include "sim/effects/plant_setup.hpp"
#include "sim/plant/plant_file.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::sim {

using SharedRotors = std::array<std::shared_ptr<const Rotor>, kAirframeRotors>;
using Rotors = std::array<const Rotor*, kAirframeRotors>;

// Reads the blade file of each rotor; rotors with the same file share one prepared geometry. Throws Error.
SharedRotors read_rotors(const PlantFile& plant);
Rotors pointers(const SharedRotors& rotors);

// Everything that is fixed before a flight, as the plant file says; its effects have not been asked yet (EffectSet::prepare).
PlantSetup plant_setup(const PlantFile& plant, const Rotors& rotors, std::int64_t step_ns, std::uint64_t seed);
AirframeConfig airframe_config(const PlantFile& plant, const Rotors& rotors, std::int64_t step_ns);
DriveParameters drive_parameters(const PlantFile& plant, const Rotor& rotor, std::size_t esc);
BatteryParameters battery_parameters(const PlantFile& plant);

}  // namespace rotorloop::sim
