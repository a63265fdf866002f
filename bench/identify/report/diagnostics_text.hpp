// How far the fit can be believed, as tables for a terminal: whiteness, agreement between flights, what stayed untold.
#pragma once
#include <string>

#include "bench/identify/report/identify_result.hpp"

namespace rotorloop::identify {

std::string whiteness_table(const std::vector<FlightWhiteness>& flights);
std::string homogeneity_table(const Identification& result, const IdentifyAnalysis& analysis);
std::string observability_table(const Observability& o);
std::string direction_text(const estimate::OpenDirection& d);  // "k_1 (+0.71), k_2 (+0.70)"

}  // namespace rotorloop::identify
