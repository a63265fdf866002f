// From planned flights to tunnel settings, and from a fit to a vehicle file: the two ends of `rotorloop calibrate`.
#pragma once
#include <string>
#include <vector>

#include "bench/hil/calibrate/fit.hpp"
#include "bench/hil/calibrate/fit_flown.hpp"
#include "bench/hil/calibrate/tunnel.hpp"
#include "host/control/trajectory.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::calibrate {

// States along a trajectory flown exactly, drag left out: the thrust axis along acceleration plus gravity, yaw 0 (the rotors
// do not care), every `period_s`.
std::vector<FlightState> planned_states(const host::Trajectory& trajectory, double mass_kg, double period_s);

// `base` with thrust, torque and drag replaced by the fit (origin stand), their covariance, and the static thrust they imply.
host::VehicleFile calibrated(const host::VehicleFile& base, const LoadFit& fit, const std::string& written_by,
                             const std::vector<std::string>& inputs);
// The same from a fit over flown states, which also replaces the centre of mass.
host::VehicleFile calibrated(const host::VehicleFile& base, const FlownFit& fit, const std::string& written_by,
                             const std::vector<std::string>& inputs);

}  // namespace rotorloop::calibrate
