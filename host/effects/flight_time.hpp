// Memory of terms that change slowly while a flight lasts: the seconds since it began, whatever the clock of the log says. Where nothing
// counts them (a controller) they stand at zero: what drifts is then as it was at the start.
#pragma once
#include "host/effects/term.hpp"
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

struct FlightTime {
  static constexpr TermMemory kMemory[] = {{{"since_start_s", "s", 0.0, 1e5, 1.0, 0.0}, 0.0}};
  static void advance(const double*, const MemoryStep& step, double* memory) { memory[0] += step.dt_s; }
};

inline constexpr double kLeastShare = 0.02;  // no vehicle flies with so little of its thrust or mass

// 1 + rate t, but never below `kLeastShare`: a straight line down to twice that, then a hyperbola that joins it with equal value and slope,
// so that a fit which tries a rate at its bound in a long flight finds its way back.
template <class S>
S share_in_time(const S& rate_1_s, const S& t_s) {
  const S line = 1.0 + rate_1_s * t_s;
  if (!(value_of(line) < 2.0 * kLeastShare)) return line;
  return kLeastShare + kLeastShare * kLeastShare / (3.0 * kLeastShare - line);
}

}  // namespace rotorloop::host
