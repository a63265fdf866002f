// The residual sections of text and page: findings in words first, then the evidence in tables and drawings.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "bench/render/document.hpp"
#include "bench/sysid/diagnose/residuals/residual_findings.hpp"

namespace rotorloop::diagnose {

// `tree`: residual_tree() of the findings, which themselves are only drawn.
render::Sections residual_sections(const nlohmann::ordered_json& tree, const ResidualFindings& findings);

}  // namespace rotorloop::diagnose
