// An identification as sections of text and page: Table I of the vehicle, compared with other files, stages, flights held out, noise,
// what the residuals say, what the flights cannot determine, findings of the checks. Figures come from the value tree that result.json is.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "bench/render/document.hpp"
#include "bench/sysid/identify/identify.hpp"
#include "bench/sysid/identify/report/identify_result.hpp"

namespace rotorloop::identify {

// `tree`: identify_tree() of this result and analysis, which themselves are only drawn.
render::Sections identify_sections(const nlohmann::ordered_json& tree, const Identification& result, const IdentifyAnalysis& analysis);

std::string p_text(double p);  // "< 1e−300" for what the number format cannot hold

}  // namespace rotorloop::identify
