// The page of a diagnosis: verdict, evidence for and against each candidate, what is left, errors before and after.
#pragma once
#include <optional>
#include <string>

#include "bench/diagnose/diagnose.hpp"

namespace rotorloop::diagnose {

struct DiagnosisPage {
  const DiagnosisRun& run;
  const std::optional<identify::HeldOutScores>& held_out;
  std::string vehicle_name;
  std::string residual_sections;  // made by residual_sections_html(); may be empty
};
std::string diagnosis_report_html(const DiagnosisPage& page);

}  // namespace rotorloop::diagnose
