// The uncertainty budget of a coefficient after the GUM: each term by name, relative to the coefficient, combined in quadrature.
#pragma once
#include "bench/stand/evaluate/estimate/coefficient.hpp"
#include "bench/stand/evaluate/estimate/stand_run.hpp"

namespace rotorloop::stand {

// Fills budget, u, degrees, low and high. `thrust`: for what thrust adds to torque through cross-talk; null where it is not known.
void add_budget(CoefficientEstimate& estimate, const StandRun& run, const CoefficientEstimate* thrust);

}  // namespace rotorloop::stand
