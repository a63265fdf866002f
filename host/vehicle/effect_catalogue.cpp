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

std::vector<CatalogueParameter> EffectCatalogue::model_parameters_of(std::string_view id) const {
  const auto at = static_cast<std::size_t>(std::find(ids.begin(), ids.end(), id) - ids.begin());
  if (at < model.size() && !model[at].empty()) return model[at];
  const CatalogueParameter* only = parameter_of(id);
  return only ? std::vector{*only} : std::vector<CatalogueParameter>{};
}

const EffectFacts* EffectCatalogue::facts_of(std::string_view id) const {
  const auto at = static_cast<std::size_t>(std::find(ids.begin(), ids.end(), id) - ids.begin());
  return at < facts.size() ? &facts[at] : nullptr;
}

namespace {
void read_range(const TomlTable& t, CatalogueParameter& p) {
  const std::vector<double> range = t.numbers("range", 2, {-1e9, 1e9, p.unit});
  p.min = range[0];
  p.max = range[1];
  p.neutral = t.number("neutral", {-1e9, 1e9, p.unit}, 0.0);
}

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
    CatalogueParameter parameter;
    parameter.name = effect.text("parameter", "");
    parameter.unit = effect.text("unit", "1");
    if (!parameter.name.empty()) {
      read_range(effect, parameter);
      parameter.typical_value = effect.number("typical_value", {parameter.min, parameter.max, parameter.unit}, parameter.min);
    }
    out.parameters.push_back(std::move(parameter));
    out.model.emplace_back();
    for (const TomlTable& t : effect.tables("model", 0, 16)) {
      CatalogueParameter& p = out.model.back().emplace_back();
      p.name = t.text("key");
      p.unit = t.text("unit");
      read_range(t, p);
    }
  }
  return out;
}
}  // namespace

EffectCatalogue read_effect_catalogue(const std::filesystem::path& path) { return catalogue_of(TomlFile::read(path)); }

EffectCatalogue builtin_effect_catalogue() { return catalogue_of(TomlFile::parse(kEffectsToml, "effects/catalogue.toml")); }

}  // namespace rotorloop::host
