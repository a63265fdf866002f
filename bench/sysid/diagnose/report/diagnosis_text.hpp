// A diagnosis as text for a terminal and as result.json; diagnosis_report.hpp has the page.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "bench/render/document.hpp"
#include "bench/sysid/diagnose/diagnose.hpp"
#include "bench/sysid/diagnose/report/diagnosis_tree.hpp"

namespace rotorloop::diagnose {

// Verdict first, then effects, flights held out, and the evidence of each screening. `tree`: diagnosis_tree().
render::Sections diagnosis_sections(const nlohmann::ordered_json& tree);
std::string verdict_name(const nlohmann::ordered_json& tree);  // "named", or "named, and something remains"

// Without the flights held out, which identify::held_out_table() has.
std::string diagnosis_text(const DiagnosisRun& run);
// Ends with a newline.
std::string diagnosis_json(const DiagnosisRun& run, const identify::IdentifyProvenance& provenance);

}  // namespace rotorloop::diagnose
