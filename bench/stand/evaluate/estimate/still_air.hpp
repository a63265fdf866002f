// Whether a run shows a propeller in air at rest. A wind tunnel's log without its airspeed, and a motor without a propeller, give figures
// that look like coefficients; thrust, torque, speed and power of the same steps distinguish them.
#pragma once
#include <optional>
#include <string>

#include "bench/stand/evaluate/estimate/stand_result.hpp"

namespace rotorloop::stand {

// Between rest (or slow steps) and fast ones: a motor that takes power and turns it neither into thrust nor into torque.
std::optional<std::string> no_propeller(const StandRun& run);

// Thrust at one speed that is not one thrust, another speed law than torque's, thrust below the reading at rest while the rotor takes
// torque: the air moves.
std::optional<std::string> moving_air(const StandEstimate& e, const StandRun& run);

}  // namespace rotorloop::stand
