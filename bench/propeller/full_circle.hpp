// From XFOIL's polars, which end at stall, to a sim::Polar over the full circle, which a rotor needs while it starts, descends or
// stalls. From XFLR5's text files and from `polar/`'s own sweeps alike.
// Beyond the computed angles: Viterna & Corrigan (NASA TM-82944, 1982) to 90 degrees, continuous with the last computed point;
// past 90 degrees a mirrored, weakened copy stands for the section in reversed flow.
#pragma once
#include <string>
#include <vector>

#include "bench/propeller/xflr5_polar.hpp"
#include "sim/rotor/polar.hpp"

namespace rotorloop::propeller {

// Lift and drag at `alpha_deg` in [match_deg, 90], from the values (cl, cd) at match_deg > 0.
sim::SectionCoefficients viterna(double match_deg, double cl, double cd, double alpha_deg);

// One section at several Reynolds numbers, in any order. Throws Error for none, for two of one Reynolds number, or for different
// airfoils. All results share one grid of angles.
sim::Polar full_circle(std::vector<SectionPolar> polars);

// (1 - weight) a + weight b, for sections that run into each other along the blade. Both from full_circle(), same Reynolds numbers.
sim::Polar blend(const sim::Polar& a, const sim::Polar& b, double weight);

// At the angles and Reynolds numbers of `like`, by the interpolation that defines a polar; unchanged where they are the same. Two sections
// of one blade may come from different places.
sim::Polar on_grid_of(const sim::Polar& like, sim::Polar polar);

// Drops the tables above the first that reaches `reynolds`: the solve spreads its rows evenly over the range that is left.
sim::Polar up_to(sim::Polar polar, double reynolds);

}  // namespace rotorloop::propeller
