// The ids of effects/catalogue.toml: the one list that plant files, vehicle files and diagnosis share. Only id and parameter
// matter here; what an effect does is written where it is used.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop::host {

// The one number of an effect; an empty name stands for an entry that declares none.
struct CatalogueParameter {
  std::string name, unit;
  double min = 0.0, max = 0.0;
  double neutral = 0.0;        // where the effect vanishes
  double typical_value = 0.0;  // the size for on/off comparisons; in an intrinsic effect the value that takes it out
};

// What diagnosis says of an effect beside its figures.
struct EffectFacts {
  std::string name, unit;
  std::string observability;       // "separable", "class_only" (from its twins not by flight alone), "not_observable"
  std::vector<std::string> twins;  // of a class_only effect
  std::string manoeuvre;           // the flight that separates it
  std::string needs;               // what a not_observable effect takes
};

struct EffectCatalogue {
  std::vector<std::string> ids;
  std::vector<CatalogueParameter> parameters;            // in the order of ids; may be shorter
  std::vector<std::vector<CatalogueParameter>> model{};  // of the model's term; where empty or absent it has the one above
  std::vector<EffectFacts> facts{};                      // in the order of ids; may be shorter
  bool knows(std::string_view id) const;
  const CatalogueParameter* parameter_of(std::string_view id) const;  // nullptr when none is declared
  // What a vehicle file holds of an effect; empty when none is declared.
  std::vector<CatalogueParameter> model_parameters_of(std::string_view id) const;
  const EffectFacts* facts_of(std::string_view id) const;  // nullptr for an unknown id
};

// Takes of every [[effect]] id, name, parameter, unit, range, neutral, typical_value, model, class, twins, manoeuvre and needs; other keys
// are the business of other readers. Throws Error on a duplicate id.
EffectCatalogue read_effect_catalogue(const std::filesystem::path& path);

// effects/catalogue.toml as it was when this program was built.
EffectCatalogue builtin_effect_catalogue();

}  // namespace rotorloop::host
