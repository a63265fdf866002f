// Section data prepared for the solve: lift and drag on a uniform grid of flow direction and Reynolds number, so that a lookup
// costs a division and six multiplications, with no trigonometry (libm differs between CPUs).
// Direction is the "diamond angle" p of the flow in the section frame, (X towards the leading edge, Y up through the chord):
// p = Y / (|X| + |Y|), continued to +-2 where X < 0. It rises with the angle of attack, is 0, 1, +-2, -1 at 0, 90, +-180, -90
// degrees, and is exact: table nodes are placed at the true angle of each p.
#pragma once
#include <vector>

#include "sim/rotor/polar.hpp"

namespace rotorloop::sim {

// Lift and drag side by side: both are interpolated at once.
typedef double ClCd __attribute__((vector_size(16)));

struct SectionTable {
  static constexpr int kDirections = 1024;  // cells over p in [-2, 2]: 0.22 degrees at zero angle of attack
  static constexpr int kRows = 19;          // Reynolds rows; with 20e3 to 200e3 a row every 10e3
  double reynolds_min = 0.0;
  double reynolds_step = 1.0;
  std::vector<ClCd> nodes;  // kRows x (kDirections + 1)

  const ClCd* row(int index) const { return nodes.data() + static_cast<std::ptrdiff_t>(index) * (kDirections + 1); }
};

// Between two polars of neighbouring stations: weight 0 is `a`, 1 is `b`.
SectionTable prepare_section(const Polar& a, const Polar& b, double weight);

// Diamond angle of an angle of attack, for tests and preparation. p in [-2, 2].
double angle_of_direction_deg(double p);

SectionCoefficients lookup(const SectionTable& table, double p, double reynolds);

}  // namespace rotorloop::sim
