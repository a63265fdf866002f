// The page of a diagnosis: verdict, evidence for and against each candidate, what is left, errors before and after.
#pragma once
#include <string>

#include "bench/sysid/diagnose/diagnose.hpp"
#include "bench/sysid/identify/report/identify_result.hpp"

namespace rotorloop::diagnose {

std::string diagnosis_report_html(const DiagnosisRun& run, const std::string& vehicle_name, const identify::IdentifyProvenance& from = {});

}  // namespace rotorloop::diagnose
