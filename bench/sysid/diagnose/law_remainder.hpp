// The unmodelled remainder of a law: what the reduced law of an effect leaves of it acts when and where the law acts, only in another
// proportion, as the law's own load times something that changes with the motion or between rotors. A force that is not quite along its
// axis, or not quite through its point, leaves the like on other axes, but no moment about its own line, and so does a moment about an axis
// that is not quite the body's; a moment leaves no force. A further effect whose part of the residual such products explain as well is no
// second cause, however certain it is; one that acts elsewhere (near the ground, where the first acts with speed) is.
#pragma once
#include <array>
#include <vector>

#include "bench/sysid/diagnose/screening.hpp"

namespace rotorloop::diagnose {

// Of a wrench, by axis: force x, y, z, torque x, y, z.
using AxesOfWrench = std::array<bool, 6>;
inline constexpr AxesOfWrench kEveryAxis{true, true, true, true, true, true};

// Columns of each flight on the axes `on`: the load of an effect that the fit has, at its size (its own on that axis, the largest force,
// and on axes of torque the largest torque), each times 1, the three velocities, the speed and the four rotor speeds, these in units of
// their own root mean square: a coefficient is a share of the load, or of its arm where a force stands for a torque. None for a quantity of
// the fit (delays, gravity's direction) and for what only sensors read, which have no load of their own.
std::vector<estimate::ExtraColumns> law_variations(const identify::Identification& fit, const Candidate& found, const AxesOfWrench& on);

// How much of what the data say of a candidate, at the size that it seems to have, is left to it once the variations of `found`, on the
// axes on which the candidate acts (all for one that no wrench holds), have taken what they can with coefficients of `law_error` (a
// standard deviation), 0 to 1. So a law is not taken to leave more than it explains: what is large beside it stays. `candidate`: of the
// screening `s` of this fit.
double share_beside_law(const identify::Identification& fit, const Candidate& found, const Screening& s, const Candidate& candidate,
                        double law_error, double block_s, int threads, estimate::StopFit stop = {});
// The same of an effect that the fit has, beside another that it has.
double share_beside_law(const identify::Identification& fit, const Candidate& found, const Candidate& other, double law_error,
                        double block_s, int threads, estimate::StopFit stop = {});

}  // namespace rotorloop::diagnose
