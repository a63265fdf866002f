// Which parameters a fit frees: the paper's θ and what the streams of the flights ask for beside it, then the user's wishes.
// A parameter that is unobservable in these streams is held from the start, so that an unobservable direction means a poor flight.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "bench/sysid/estimate/estimator.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::identify {

// NAME or NAME=U in `free`: U is the standard deviation of a prior about the start value, in SI. A name is that of a parameter
// ("drag.c_dh"), its symbol ("c_d,h"), or a group ("drag", "pose_sensor", "body.inertia", "effect.rotor_local_inflow").
struct ParameterSelection {
  std::vector<std::string> free, hold, per_flight;
};

// Throws Error (usage) for an unknown name, with those that exist.
std::vector<estimate::FreeParameter> choose_parameters(std::span<const estimate::GridFlight> flights, const host::VehicleFile& vehicle,
                                                       const host::TermList& terms, const ParameterSelection& wishes);

// Parameters that `name` means: one, or a group; throws as above.
std::vector<int> parameters_named(const std::string& name, const host::TermList& terms);

// Standard uncertainty that the vehicle file gives a parameter; 0 when it gives none.
double prior_u_of(const host::VehicleFile& vehicle, int parameter, const host::TermList& terms);

}  // namespace rotorloop::identify
