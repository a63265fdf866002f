// Whether a refit finds an effect: Wald's test of all its numbers together, over their joint covariance. Numbers that share a direction
// which flights poorly determine (those of four rotors) are each uncertain by more than their size where together they are beyond doubt.
#pragma once
#include "bench/sysid/diagnose/screening.hpp"

namespace rotorloop::diagnose {

struct WaldTest {
  double statistic = 0.0;  // over its degrees of freedom; of one number the square of its standard errors
  int degrees = 0;
  double p = 1.0;          // chance of as much where the effect is absent: F with as many degrees of freedom as the fit has blocks
  double inflation = 1.0;  // what the blocks scatter over what the noise says, as a variance; mean of the directions
  double blocks = 0.0;     // of the fit, that p counts with
  double sure = 1.0;       // … and that of a single number `fewest_u` standard errors off: above it the effect may be chance
};
// Of the candidate's numbers about neutral in a fit that has it. Covariance: the larger of classical and block-robust, direction by
// direction, without the sum that a gauge holds (bench/sysid/identify/gauge.hpp).
WaldTest wald_test(const identify::Identification& fit, const Candidate& candidate, double fewest_u);

}  // namespace rotorloop::diagnose
