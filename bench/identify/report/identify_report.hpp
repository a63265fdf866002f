// report.html of `identify`: Table I of this vehicle, the same beside other files, stages beside the joint fit, noise, what the
// residuals say, what the flights could not tell, findings of the checks; and with other results the trail of each parameter over
// trials (the paper's Fig. 8).
#pragma once
#include <string>
#include <vector>

#include "bench/identify/report/identify_page.hpp"
#include "bench/identify/report/identify_result.hpp"
#include "bench/identify/report/trail_point.hpp"

namespace rotorloop::identify {

std::string identify_report_html(const IdentifyPage& page);

// What the files beside say of each parameter, for the trail.
std::vector<TrailReference> trail_references(const FileComparison& comparison, const std::vector<DerivedQuantity>& derived,
                                             const host::TermList& terms);

}  // namespace rotorloop::identify
