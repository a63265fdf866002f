// The [esc] section of a plant file: power stage, how true it is, and what the ESCs were told of their motors.
#pragma once
#include "host/base/toml_file.hpp"
#include "sim/plant/plant_file.hpp"

namespace rotorloop::sim {

// Absent: b_g431b_esc1, ideal, common clock, motor_file, 40 A. Throws Error with file, line, key, value, unit, range and remedy; so it
// does for a battery that the power stage cannot take.
PlantEsc read_plant_esc(const TomlTable& root, const PlantBattery& battery);

}  // namespace rotorloop::sim
