// The names that --free, --hold, --per-flight and --term take, for a person to choose from: `rotorloop identify --names`.
#pragma once
#include <string>
#include <string_view>

#include "bench/sysid/estimate/model/parameters.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::identify {

std::string_view meaning_of(estimate::Parameter parameter);

// Every parameter with symbol, unit and meaning, the groups, and every term with its parameters and its name in the catalogue.
std::string names_table(const host::EffectCatalogue& catalogue);

}  // namespace rotorloop::identify
