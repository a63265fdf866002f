// report.html of `identify`: Table I of this vehicle, its comparison with other files, stages and joint fit, noise, what the
// residuals say, what the flights could not determine, findings of the checks; and with other results the history of each parameter over
// trials (the paper's Fig. 8).
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/identify/report/history_point.hpp"
#include "bench/sysid/identify/report/identify_page.hpp"
#include "bench/sysid/identify/report/identify_result.hpp"

namespace rotorloop::identify {

std::string identify_report_html(const IdentifyPage& page);

// What the compared files say of each parameter, for the parameter history.
std::vector<HistoryReference> history_references(const FileComparison& comparison, const std::vector<DerivedQuantity>& derived,
                                                 const host::TermList& terms);

}  // namespace rotorloop::identify
