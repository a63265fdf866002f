// Memory of terms that change slowly while a flight lasts: the seconds since it began, whatever the clock of the log says. Where nothing
// counts them (a controller) they stand at zero: what drifts is then as it was at the start.
#pragma once
#include "host/effects/term.hpp"

namespace rotorloop::host {

struct FlightTime {
  static constexpr TermMemory kMemory[] = {{{"since_start_s", "s", 0.0, 1e5, 1.0, 0.0}, 0.0}};
  static void advance(const double*, const MemoryStep& step, double* memory) { memory[0] += step.dt_s; }
};

}  // namespace rotorloop::host
