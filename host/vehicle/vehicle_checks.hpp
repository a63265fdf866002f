// Checks between quantities of a vehicle file, with the position of the culprit: what a range on one key cannot find.
#pragma once
#include "host/base/toml_file.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::host {

// Throws Error for the first thing that cannot be.
void check_vehicle(const VehicleFile& vehicle, const TomlTable& root);

}  // namespace rotorloop::host
