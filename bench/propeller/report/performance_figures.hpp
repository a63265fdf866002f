// What a rotor does: its coefficients in climb and edgewise flow, and its loads through descent, vortex ring and windmill.
#pragma once
#include <string>

#include "sim/rotor/bem.hpp"

namespace rotorloop::propeller {

std::string status_name(sim::InflowStatus status);  // for readers: "vortex ring"

// HTML. Speed and density are taken from `condition`, which is turning.
std::string advance_section_html(const sim::Rotor& rotor, const sim::RotorCondition& condition);
std::string edgewise_section_html(const sim::Rotor& rotor, const sim::RotorCondition& condition);
std::string descent_section_html(const sim::Rotor& rotor, const sim::RotorCondition& condition);

}  // namespace rotorloop::propeller
