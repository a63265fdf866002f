#include "host/vehicle/effect_catalogue.hpp"

#include <algorithm>

#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"
#include "rotorloop_effects.hpp"

namespace rotorloop::host {
namespace {

CatalogueParameter parameter_in(const TomlTable& t, std::string name, std::string unit) {
  CatalogueParameter p{std::move(name), std::move(unit)};
  if (p.name.empty()) return p;
  const std::vector<double> range = t.numbers("range", 2, {-1e9, 1e9, p.unit});
  p.min = range[0];
  p.max = range[1];
  p.neutral = t.number("neutral", {-1e9, 1e9, p.unit}, 0.0);
  p.typical_value = t.number("typical_value", {p.min, p.max, p.unit}, p.min);
  return p;
}

EffectKind kind_in(const TomlTable& t) {
  constexpr std::string_view kNames[]{"term", "dynamic", "sensor", "parameter", "variance", "none"};  // as EffectKind
  const std::string name = t.choice("kind", {kNames[0], kNames[1], kNames[2], kNames[3], kNames[4], kNames[5]}, "none");
  return static_cast<EffectKind>(std::find(std::begin(kNames), std::end(kNames), name) - std::begin(kNames));
}

CatalogueEffect effect_in(const TomlTable& t) {
  CatalogueEffect row{.id = t.text("id"),
                      .name = t.text("name", t.text("id")),
                      .kind = kind_in(t),
                      .parameter = parameter_in(t, t.text("parameter", ""), t.text("unit", "1")),
                      .observability = t.text("class", ""),
                      .manoeuvre = t.text("manoeuvre", ""),
                      .next = t.text("next", ""),
                      .needs = t.text("needs", "")};
  if (t.has("fit")) row.fit = t.texts("fit");
  if (t.has("twins")) row.twins = t.texts("twins");
  for (const TomlTable& m : t.tables("model", 0, 16)) row.model.push_back(parameter_in(m, m.text("key"), m.text("unit")));
  if (row.model.empty() && !row.parameter.name.empty()) row.model = {row.parameter};
  return row;
}

EffectCatalogue catalogue_of(const TomlFile& file) {
  EffectCatalogue out;
  for (const TomlTable& t : file.root().tables("effect", 1, 1000)) {
    CatalogueEffect e = effect_in(t);
    if (out.find(e.id)) t.fail("id", "effect id \"" + e.id + "\" occurs twice", "a copied block", "give every effect its own id");
    out.effects.push_back(std::move(e));
  }
  return out;
}

}  // namespace

const CatalogueEffect* EffectCatalogue::find(std::string_view id) const {
  const auto at = std::find_if(effects.begin(), effects.end(), [&](const CatalogueEffect& e) { return e.id == id; });
  return at == effects.end() ? nullptr : &*at;
}

EffectCatalogue read_effect_catalogue(const std::filesystem::path& path) { return catalogue_of(TomlFile::read(path)); }

const EffectCatalogue& builtin_effect_catalogue() {
  static const EffectCatalogue catalogue = catalogue_of(TomlFile::parse(kEffectsToml, "effects/catalogue.toml"));
  return catalogue;
}

const CatalogueEffect& effect(std::string_view id) {
  if (const CatalogueEffect* e = builtin_effect_catalogue().find(id)) return *e;
  throw Error({"effects/catalogue.toml", "effect \"" + std::string(id) + "\" has no row", "", "describe it there"});
}

}  // namespace rotorloop::host
