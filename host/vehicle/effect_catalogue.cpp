#include "host/vehicle/effect_catalogue.hpp"

#include <algorithm>

#include "host/base/toml_file.hpp"
#include "rotorloop_effects.hpp"

namespace rotorloop::host {

bool EffectCatalogue::knows(std::string_view id) const { return std::find(ids.begin(), ids.end(), id) != ids.end(); }

namespace {
EffectCatalogue catalogue_of(const TomlFile& file) {
  EffectCatalogue out;
  for (const TomlTable& effect : file.root().tables("effect", 1, 1000)) {
    std::string id = effect.text("id");
    if (out.knows(id)) effect.fail("id", "effect id \"" + id + "\" occurs twice", "a copied block", "give every effect its own id");
    out.ids.push_back(std::move(id));
  }
  return out;
}
}  // namespace

EffectCatalogue read_effect_catalogue(const std::filesystem::path& path) { return catalogue_of(TomlFile::read(path)); }

EffectCatalogue builtin_effect_catalogue() { return catalogue_of(TomlFile::parse(kEffectsToml, "docs/effects.toml")); }

}  // namespace rotorloop::host
