#include "host/vehicle/effect_catalogue.hpp"

#include <algorithm>

#include "host/base/toml_file.hpp"
#include "rotorloop_effects.hpp"

namespace rotorloop::host {

bool EffectCatalogue::knows(std::string_view id) const { return std::find(ids.begin(), ids.end(), id) != ids.end(); }

const CatalogueParameter* EffectCatalogue::parameter_of(std::string_view id) const {
  const auto at = static_cast<std::size_t>(std::find(ids.begin(), ids.end(), id) - ids.begin());
  return at < parameters.size() && !parameters[at].name.empty() ? &parameters[at] : nullptr;
}

const EffectFacts* EffectCatalogue::facts_of(std::string_view id) const {
  const auto at = static_cast<std::size_t>(std::find(ids.begin(), ids.end(), id) - ids.begin());
  return at < facts.size() ? &facts[at] : nullptr;
}

namespace {
EffectCatalogue catalogue_of(const TomlFile& file) {
  EffectCatalogue out;
  for (const TomlTable& effect : file.root().tables("effect", 1, 1000)) {
    std::string id = effect.text("id");
    if (out.knows(id)) effect.fail("id", "effect id \"" + id + "\" occurs twice", "a copied block", "give every effect its own id");
    EffectFacts facts{effect.text("name", id),      effect.text("unit", "1"), effect.text("class", ""), {},
                      effect.text("manoeuvre", ""), effect.text("needs", "")};
    if (effect.has("twins")) facts.twins = effect.texts("twins");
    out.facts.push_back(std::move(facts));
    out.ids.push_back(std::move(id));
    CatalogueParameter parameter{effect.text("parameter", ""), effect.text("unit", "1")};
    if (!parameter.name.empty()) {
      const std::vector<double> range = effect.numbers("range", 2, {-1e9, 1e9, parameter.unit});
      parameter.min = range[0];
      parameter.max = range[1];
      parameter.typical_value = effect.number("typical_value", {range[0], range[1], parameter.unit}, range[0]);
    }
    out.parameters.push_back(std::move(parameter));
  }
  return out;
}
}  // namespace

EffectCatalogue read_effect_catalogue(const std::filesystem::path& path) { return catalogue_of(TomlFile::read(path)); }

EffectCatalogue builtin_effect_catalogue() { return catalogue_of(TomlFile::parse(kEffectsToml, "docs/effects.toml")); }

}  // namespace rotorloop::host
