// Sections of the identification report that are tables of numbers: Table I of the vehicle, the same beside other files, noise.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "bench/identify/report/identify_page.hpp"

namespace rotorloop::identify {

std::string parameters_html(const IdentifyPage& page);  // with what follows from them
std::string beside_html(const IdentifyPage& page);      // empty without files beside and static thrust
std::string noise_html(const IdentifyPage& page);
std::vector<std::pair<std::string, std::string>> conditions_facts(const IdentifyPage& page);  // how the fit was asked for

}  // namespace rotorloop::identify
