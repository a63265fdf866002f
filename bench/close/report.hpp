// One page that tells a loop from end to end: the error before, what the analyst was shut away from, the evidence for and against each
// effect, what was chosen, what it foretells, and the error after.
#pragma once
#include <string>

#include "bench/close/loop_result.hpp"

namespace rotorloop::closed_loop {

// Self-contained HTML. Reads the logs of the first judged seed for the plots over time; a log that is gone leaves its plot out.
std::string loop_report_html(const LoopResult& result);

}  // namespace rotorloop::closed_loop
