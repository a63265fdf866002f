// All that text and report.html of `identify` are made from.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/identify/report/history_point.hpp"
#include "bench/sysid/identify/report/identify_result.hpp"

namespace rotorloop::identify {

struct IdentifyPage {
  const Identification& result;
  const IdentifyAnalysis& analysis;
  const FileComparison& comparison;
  const std::vector<log::CheckedFlight>& checked;
  const IdentifyProvenance& provenance;
  std::string start_name;                  // that the start file gives the vehicle
  std::vector<HistoryPoint> history = {};  // this result's own comes last; fewer than two: no section
  std::vector<HistoryReference> references = {};
};

}  // namespace rotorloop::identify
