// report.html of `identify`: Table I of this vehicle, stages beside the joint fit, what the residuals say, what the flights could
// not tell, findings of the checks; and with other results the trail of each parameter over trials (the paper's Fig. 8).
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "bench/identify/identify_result.hpp"

namespace rotorloop::bench {

struct IdentifyPage {
  const Identification& result;
  const IdentifyAnalysis& analysis;
  const std::vector<CheckedFlight>& checked;
  const host::VehicleFile& before;
  std::string vehicle_name, subtitle;
  std::vector<std::pair<std::string, std::string>> facts;  // command, inputs …
  std::vector<TrailPoint> trail;                           // this result's own comes last; fewer than two: no section
  std::string held_out_html;                               // section of prediction scores, made elsewhere; may be empty
};
std::string identify_report_html(const IdentifyPage& page);

// The page of `identify trail`: nothing but the trail.
std::string trail_page_html(const std::vector<TrailPoint>& trail);

}  // namespace rotorloop::bench
