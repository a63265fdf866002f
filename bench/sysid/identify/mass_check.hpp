// A weighed mass that the flights contradict.
#pragma once
#include <optional>

#include "bench/sysid/identify/identify.hpp"
#include "host/base/error.hpp"

namespace rotorloop::identify {

// The error of a fit that moved the mass of the file, where that is no guess, by five of its u or more; none else. Every force and every
// inertia scales with the mass: a fit that moves it so far puts into it what the model lacks, and all other numbers with it.
std::optional<Error> mass_contradicted(const Identification& result, const host::VehicleFile& vehicle);

}  // namespace rotorloop::identify
