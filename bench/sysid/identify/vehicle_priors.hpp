// Priors of a fit from the vehicle file. What was drawn or measured on a stand counts with its uncertainty and, where the file has it, its
// covariance.
#pragma once
#include <span>
#include <vector>

#include "bench/sysid/estimate/estimator.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::identify {

// About the free, shared parameters among `free`. What earlier flights found counts with its uncertainty, static thrust found on a stand
// ties k_1 and k_2. Guesses give no prior.
std::vector<estimate::JointPrior> vehicle_priors(const host::VehicleFile& vehicle, std::span<const estimate::FreeParameter> free,
                                                 const estimate::ModelValues& file_values);

// For a fit that is to stand beside the file's other sources: what earlier flights found is no better than a guess, for they may be the
// same flights; a guess is a weak prior, right to a factor of three, that decides only what the flights leave open; and static thrust of a
// stand is left out, for the fit's own is compared with it.
std::vector<estimate::JointPrior> priors_beside_flights(const host::VehicleFile& vehicle, std::span<const estimate::FreeParameter> free,
                                                        const estimate::ModelValues& file_values);

}  // namespace rotorloop::identify
