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

// Derivation. The law found gives the load L(t); the true load is L(t) (1 + Σ β_j b_j(t)), with b_j 1, the velocities and the rotor speeds
// in units of their root mean square, and β_j normal about 0 with a standard deviation σ (`law_error`): the discrepancy of a reduced law
// (Kennedy, O'Hagan, Bayesian Calibration of Computer Models, 2001). The products L b_j are columns of the linear model like any other; as
// β_j is known to ±σ beforehand, 1/σ² is added to their information Λ. For a candidate of columns g and size a, with I the information that
// is left once the parameters of the model have taken theirs:
//   alone:                 q  = aᵀ I_gg a
//   beside the remainder:  q' = aᵀ (I_gg - I_gβ (I_ββ + Λ)⁻¹ I_βg) a,   Λ = 1/σ² on the diagonal
// which is the information about g with β integrated out (both are normal). q'/q, from 0 to 1, is the candidate's own share.

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
