// How well the models predict flights that had no part in the fit: sections of text and page, from held_out_json() and wrench_json().
#pragma once
#include <nlohmann/json.hpp>

#include "bench/render/document.hpp"

namespace rotorloop::identify {

render::Sections held_out_sections(const nlohmann::ordered_json& held_out);
render::Sections wrench_sections(const nlohmann::ordered_json& wrench);

}  // namespace rotorloop::identify
