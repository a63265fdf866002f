// The files that an estimate leaves for the rest of rotorloop: a motor file (vehicles/motors/NAME.toml) and a vehicle file with what the
// stand says.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "bench/stand/evaluate/estimate/advance_torque.hpp"
#include "bench/stand/evaluate/estimate/stand_estimate.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::stand {

struct MotorFileOptions {
  std::filesystem::path base;                     // motor file for what the run does not show; empty: refused where something is missing
  std::optional<double> propeller_inertia_kg_m2;  // taken from the measured J; without it the base's inertia stays
};

// Text of a motor file; each line says whether it was measured. Throws Error (data_quality) that names what the run does not show.
std::string motor_file_text(const StandEstimate& e, const MotorFileOptions& options, const std::string& written_by);

// `vehicle` with a [[static_thrust]] of origin stand (in place of one that it has), c_q and c_q(J), all at the vehicle's density.
host::VehicleFile with_stand_values(host::VehicleFile vehicle, const StandEstimate& e, const std::string& written_by,
                                    const AdvanceTorque* advance = nullptr);

}  // namespace rotorloop::stand
