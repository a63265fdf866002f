// A blade for the BEM rotor model from a geometry and the names of its sections.
#pragma once
#include "bench/propeller/propeller_inputs.hpp"
#include "sim/rotor/blade.hpp"

namespace rotorloop::propeller {

// A section's polars: those ready; of the data folder (NAME_Re*.txt), else a shipped one, else made. Digits alone ("4412") and paths of
// .dat files are always made where something can make them. Throws Error where there are none.
SectionPolars read_section(const PropellerInputs& inputs, const std::string& name);

// The largest chord Reynolds number that any row reaches: section tables go no further.
double largest_reynolds(const PropellerGeometry& g, const std::vector<MeasuredSet>& sets, double diameter_m);

sim::Blade to_blade(const PropellerInputs& inputs, const PropellerGeometry& g, const SectionChoice& section, double reynolds);

}  // namespace rotorloop::propeller
