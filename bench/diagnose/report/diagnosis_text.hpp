// A diagnosis as tables for people and as result.json for programs.
#pragma once
#include <string>

#include "bench/diagnose/diagnose.hpp"
#include "bench/identify/report/identify_result.hpp"

namespace rotorloop::diagnose {

std::string verdict_name(const Diagnosis& d);  // "named", or "named, and something remains"
std::string remaining_text(const RemainingResidual& r);
std::string diagnosis_text(const DiagnosisRun& run);  // verdict first, then evidence
// Ends with a newline.
std::string diagnosis_json(const DiagnosisRun& run, const identify::IdentifyProvenance& provenance);

}  // namespace rotorloop::diagnose
