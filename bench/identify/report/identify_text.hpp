// What a fit says, as tables for a terminal.
#pragma once
#include <string>

#include "bench/identify/derived.hpp"
#include "bench/identify/identify.hpp"

namespace rotorloop::identify {

// Marks beside an estimate: "at its bound" when it stopped at the end of its range, "not identified" when its prior holds more than half of
// what is known ("weighed" for the mass, which no flight can tell; "contradicted" when the flights move it by two of the prior's standard
// deviations all the same), "model error" when the uncertainty that holds for correlated residuals is 5 times the classical one or more.
std::string mark_of(const estimate::Estimate& e);

// That the robust uncertainties rest on too few blocks of residuals to hold; empty when they do not.
std::string blocks_note(const estimate::Fit& fit);

std::string estimates_table(const Identification& result, const host::VehicleFile& before);
std::string derived_table(const std::vector<DerivedQuantity>& derived);
std::string stages_table(const Identification& result);
std::string noise_table(const Identification& result);

}  // namespace rotorloop::identify
