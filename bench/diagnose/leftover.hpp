// What the reduced law of an effect leaves of it acts when and where the law acts, only in another proportion: as the law's own load, axis
// by axis, times something that changes with the motion. A further effect whose part of the residual such products explain as well
// is no second cause, however certain it is; one that acts elsewhere (near the ground, where the first acts with speed) is.
#pragma once
#include <vector>

#include "bench/diagnose/screening.hpp"

namespace rotorloop::diagnose {

// Columns of each flight: the load of an effect that the fit has, at its size, on each axis by itself, times 1, the three velocities, the
// horizontal speed and the mean rotor speed. Empty for a quantity of the fit (delays, gravity's direction), which has no law of its own.
std::vector<estimate::ExtraColumns> law_variations(const identify::Identification& fit, const Candidate& found);

// How much of what the data could say of each candidate, at the size that it seems to have, is left to it once the variations of `found`
// have taken theirs, 0 to 1. Those without a term get 1. `candidates`: of the screening `s` of this fit.
std::vector<double> left_beside(const identify::Identification& fit, const Candidate& found, const Screening& s,
                                const std::vector<const Candidate*>& candidates, double block_s, int threads, estimate::StopFit stop = {});

}  // namespace rotorloop::diagnose
