// The diagnosis's part of the loop's page: evidence for and against each candidate, round by round; what was added; what it predicts.
#pragma once
#include <filesystem>
#include <string>

#include "bench/hil/closed_loop/findings.hpp"

namespace rotorloop::closed_loop {

std::string evidence_section(const Findings& findings);
std::string added_section(const Findings& findings);
std::string held_out_section(const Findings& findings);
// What the diagnosis's own page shows of the residual that is left (its section "wrench"), and a link to that page as `link`; empty when
// there is no such page. The diagnosis's text is not ours: a page with a script is only linked.
std::string residual_section(const std::filesystem::path& page, const std::string& link);

}  // namespace rotorloop::closed_loop
