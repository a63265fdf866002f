// One page of a closed-loop study: the error before, what the sandbox kept closed, the evidence for and against each
// effect, what was chosen, what it predicts, and the error after.
#pragma once
#include <string>

#include "bench/hil/closed_loop/loop_result.hpp"

namespace rotorloop::closed_loop {

// Self-contained HTML. Reads the logs of the first judged seed for the plots over time; a log that is gone leaves its plot out.
std::string loop_report_html(const LoopResult& result);

}  // namespace rotorloop::closed_loop
