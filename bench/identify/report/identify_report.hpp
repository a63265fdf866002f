// report.html of `identify`: Table I of this vehicle, the same beside other files, stages beside the joint fit, noise, what the
// residuals say, what the flights could not tell, findings of the checks; and with other results the trail of each parameter over
// trials (the paper's Fig. 8).
#pragma once
#include <string>
#include <vector>

#include "bench/identify/report/identify_result.hpp"
#include "bench/identify/report/trail.hpp"

namespace rotorloop::identify {

struct IdentifyPage {
  const Identification& result;
  const IdentifyAnalysis& analysis;
  const FileComparison& comparison;
  const std::vector<log::CheckedFlight>& checked;
  const IdentifyProvenance& provenance;
  std::string start_name;              // that the start file gives the vehicle
  std::vector<TrailPoint> trail = {};  // this result's own comes last; fewer than two: no section
  std::vector<TrailReference> references = {};
  std::string held_out_html = {};  // section of prediction scores, made elsewhere; may be empty
};
std::string identify_report_html(const IdentifyPage& page);

// What the files beside say of each parameter, for the trail.
std::vector<TrailReference> trail_references(const FileComparison& comparison, const std::vector<DerivedQuantity>& derived,
                                             const host::TermList& terms);

}  // namespace rotorloop::identify
