// The ids of docs/effects.toml: the one list that plant files, vehicle files and diagnosis share. Only the ids matter here;
// what an effect does is written where it is used.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop::host {

struct EffectCatalogue {
  std::vector<std::string> ids;
  bool knows(std::string_view id) const;
};

// Takes the `id` of every [[effect]]; other keys are the business of other readers. Throws Error on a duplicate id.
EffectCatalogue read_effect_catalogue(const std::filesystem::path& path);

// docs/effects.toml as it was when this program was built.
EffectCatalogue builtin_effect_catalogue();

}  // namespace rotorloop::host
