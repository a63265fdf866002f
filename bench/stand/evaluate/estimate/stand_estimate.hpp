// c_t and c_q of one run with an uncertainty that names its parts: what the run's own scatter says (bootstrap over steps), and what it
// cannot show (calibration, density, alignment …: StandUncertainty), combined after the GUM (JCGM 100).
#pragma once
#include <array>

#include "bench/stand/evaluate/estimate/stand_result.hpp"

namespace rotorloop::stand {

// Least and largest speed of the steps that turn, rad/s; infinity and 0 without any.
std::array<double, 2> speeds_of(const StandRun& run);

StandEstimate estimate_stand(const StandRun& run, const EstimateOptions& options);

}  // namespace rotorloop::stand
