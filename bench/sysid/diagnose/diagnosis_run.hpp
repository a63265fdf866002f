// All that a diagnosis comes to: what it says, the models before and after, what is left of the flights, the error on flights held out.
#pragma once
#include <optional>

#include "bench/sysid/diagnose/diagnosis.hpp"
#include "bench/sysid/diagnose/residuals/residual_findings.hpp"
#include "bench/sysid/identify/held_out.hpp"
#include "bench/sysid/identify/identify.hpp"

namespace rotorloop::diagnose {

struct DiagnosisRun {
  Diagnosis diagnosis;
  identify::Identification before, after;           // the model of the vehicle file refitted, and that with the effects
  std::optional<ResidualFindings> residuals;        // of the model after; none where flights have no poses
  std::optional<identify::HeldOutScores> held_out;  // none without flights held out
};

}  // namespace rotorloop::diagnose
