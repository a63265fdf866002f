// The solvers that `rotorloop identify --solver` names.
#pragma once
#include "bench/identify/stages.hpp"

namespace rotorloop::bench {

// Noise, robust errors and innovations by the own sweep, then estimates, uncertainties and covariance by Ceres at that noise.
Solver ceres_solver();

}  // namespace rotorloop::bench
