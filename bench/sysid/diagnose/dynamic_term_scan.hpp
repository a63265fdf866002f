// Where to look for a dynamic term. At its neutral size its other numbers (length and damping of a load on a string) change nothing,
// so the sweep of all candidates cannot find them: they are chosen before it, where the term's load follows best what the model leaves.
#pragma once
#include <vector>

#include "bench/sysid/diagnose/candidate.hpp"
#include "bench/sysid/identify/identify.hpp"

namespace rotorloop::diagnose {

struct ScanPoint {
  std::vector<double> parameters;  // the first is its estimate
  double gain = 0.0;               // share of the residual's weighted squares that goes, 0 to 1; 0 when the estimate has the wrong sign
};
// The term's scan (TermInfo::scan) against the residual of a fit, best first. Constant parts of either do not count: weight is determined
// by thrust, not by a swing.
std::vector<ScanPoint> scan_dynamic_term(const identify::Identification& fitted, const host::Term& term, int threads);

// Moves the candidate's parameters but the first to the best of the scan.
void start_where_scan_is_best(const identify::Identification& fitted, Candidate& candidate, int threads);

}  // namespace rotorloop::diagnose
