// The drawings of the identification report, as SVG or as figures with caption.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/identify/report/history_point.hpp"
#include "bench/sysid/identify/report/identify_result.hpp"

namespace rotorloop::identify {

std::string autocorrelation_figure(const FlightWhiteness& whiteness);  // with the ± 2/√n band of white noise
std::string cost_figure(const FlightWhiteness& whiteness);             // mean square of innovations in each second
std::string innovation_figure(const std::string& flight, const std::vector<estimate::Innovation>& innovations);
std::string correlation_map(const Identification& result);  // SVG, with its legend
// One parameter over the trials, in units of a power of a thousand so that ticks stay short.
std::string history_figure(const std::vector<HistoryPoint>& history, const std::vector<HistoryReference>& references,
                           const std::string& parameter, const std::string& unit);

}  // namespace rotorloop::identify
