// What the vehicle file knows, as knowledge that a fit starts from: values with their uncertainty and, where the file has them, their
// covariance; and static thrust found on a stand. Guesses are no knowledge.
#pragma once
#include <span>
#include <vector>

#include "bench/identify/estimator.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::bench {

// About the free, shared parameters among `free`.
std::vector<JointPrior> beliefs(const host::VehicleFile& vehicle, std::span<const FreeParameter> free, const ModelValues& file_values);

}  // namespace rotorloop::bench
