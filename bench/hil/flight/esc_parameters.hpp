// What was written into an ESC when it was set up: its motor as its owner knows it, and limits that follow from board, battery and
// motor. Never the plant's truth about wear, damage or a drawn board.
#pragma once
#include <cstdint>

#include "firmware/core/interface.hpp"
#include "host/vehicle/model.hpp"
#include "sim/esc/servable_limit.hpp"
#include "sim/plant/plant_file.hpp"

namespace rotorloop::hil {

using sim::kFullCell_V;
inline constexpr double kEmptyCell_V = 3.0;  // of lithium polymer

// `esc` from 0; `blade_inertia_kg_m2` of its rotor: a commissioning measures it, a data sheet does not know it. Without an [esc]
// section in the plant the speed limits are those of the reference drive (17 000 and 1 000 RPM).
firmware::Parameters esc_parameters(const sim::PlantFile& plant, const host::VehicleModel& vehicle, int esc, double blade_inertia_kg_m2,
                                    std::uint64_t seed);

// The phase inductance in `esc_parameters`, `esc` from 0, before the error of a data sheet or a commissioning that a seed draws.
double nominal_inductance_H(const sim::PlantFile& plant, std::size_t esc);

// 200 000 electrical RPM is what the firmware follows; a motor without load reaches Kv times the full battery.
double highest_esc_speed_rad_s(const sim::MotorFile& motor, int cells);

}  // namespace rotorloop::hil
