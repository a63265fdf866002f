// A diagnosis as the value tree that text and page are rendered from, and that result.json is.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "bench/sysid/diagnose/diagnose.hpp"
#include "bench/sysid/identify/report/identify_result.hpp"

namespace rotorloop::diagnose {

nlohmann::ordered_json diagnosis_tree(const DiagnosisRun& run, const identify::IdentifyProvenance& provenance);

}  // namespace rotorloop::diagnose
