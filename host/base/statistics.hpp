// Tail probabilities and corrections that the screening needs.
#pragma once
#include <span>
#include <vector>

namespace rotorloop {

// Chance that an F variable with (d1, d2) degrees of freedom is at least x.
double f_tail(double x, double d1, double d2);

// Holm (1979): p values adjusted for as many tests as there are, in the same order; below a level exactly where the step-down
// procedure rejects at that level.
std::vector<double> holm(std::span<const double> p);

}  // namespace rotorloop
