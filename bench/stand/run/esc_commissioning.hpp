// The ESC's own measurement of its motor at rest, before a run. At speed the drop across the winding is small against the back-EMF, so that
// the power of a run shows resistance by a tenth; direct currents show it to 2 %.
#pragma once
#include <optional>

#include "bench/stand/run/preparation.hpp"

namespace rotorloop::stand_run {

// Begins a commissioning at rest (the rotor moves by one electrical turn), waits for its end and gives the ESC its own parameters back:
// nothing of it is in force or stored. Nothing when the tool was stopped meanwhile. Throws Error: device when the ESC has no commissioning
// or does not answer, safety when it ended otherwise than done.
std::optional<stand::MeasuredWinding> measure_winding(tools::ToolNode& tool, const tools::EscTable& table, const EscFacts& esc,
                                                      int esc_index);

}  // namespace rotorloop::stand_run
