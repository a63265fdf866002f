// The analyst's part of the loop's page: evidence for and against each candidate, round by round; what was added; what it foretells.
#pragma once
#include <string>

#include "bench/close/findings.hpp"

namespace rotorloop::bench {

std::string evidence_section(const Findings& findings);
std::string added_section(const Findings& findings);
std::string held_out_section(const Findings& findings);

}  // namespace rotorloop::bench
