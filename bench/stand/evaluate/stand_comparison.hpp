// Stand files against each other: the thrust coefficient is the propeller's, so that a file far from the others of its propeller has a
// fault; speed, voltage and current decide which, as a motor at full command turns at K (V - R I) whatever it drives.
#pragma once
#include "bench/stand/evaluate/stand_findings.hpp"

namespace rotorloop::stand {

// Marks files (verdict faulty, with words and figures) and says in `remarks` how far those that agree scatter.
void compare_stands(StandDiagnosis& all);

}  // namespace rotorloop::stand
