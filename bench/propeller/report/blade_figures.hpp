// What a blade is, for the rotor's page: plan form, twist, sections, polars, and the tables of its figures.
#pragma once
#include <string>

#include "sim/rotor/bem.hpp"

namespace rotorloop::propeller {

double blade_solidity(const sim::Rotor& rotor);  // blade area over pi R^2

// HTML. `rotor` is the prepared blade: the curves show what is solved, between the stations of the file too.
std::string blade_section_html(const sim::Blade& blade, const sim::Rotor& rotor);

}  // namespace rotorloop::propeller
