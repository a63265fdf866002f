// The rows of effects/catalogue.toml: the one list that plant files, vehicle files and diagnosis share. What an effect does is written
// where it is used; every id that the code names must have a row, and lint looks.
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

// How models hold an effect, and so which test may name it in flight logs.
enum class EffectKind {
  term,       // force, torque or air that a term of host/effects adds
  dynamic,    // a term whose load depends on the past (memory.hpp)
  sensor,     // a term that changes what sensors read, and no load
  parameter,  // quantities of the fit itself (`fit`)
  variance,   // changes how much residuals scatter, not their mean
  none,       // no model holds it: only plants, or nothing yet
};

struct CatalogueEffect {
  std::string id = {}, name = {};
  EffectKind kind = EffectKind::none;
  std::vector<std::string> fit = {};  // of kind parameter: names of the fit's parameters
  CatalogueParameter parameter = {};
  std::vector<CatalogueParameter> model = {};  // what a vehicle file holds of it: of its term, or the one above; may be empty
  std::string observability = {};              // "separable", "class_only" (from its twins not by flight alone), "not_observable"
  std::vector<std::string> twins = {};         // of a class_only effect
  std::string manoeuvre = {};                  // the flight that separates it
  std::string next = {};                       // what a person does about it; empty: the vehicle file holds it
  std::string needs = {};                      // what a not_observable effect takes
};

struct EffectCatalogue {
  std::vector<CatalogueEffect> effects;
  const CatalogueEffect* find(std::string_view id) const;  // nullptr for an unknown id
};

// Takes the columns above of every [[effect]]; other keys are the business of other readers. Throws Error on a duplicate id.
EffectCatalogue read_effect_catalogue(const std::filesystem::path& path);

// effects/catalogue.toml as it was when this program was built; parsed at the first call.
const EffectCatalogue& builtin_effect_catalogue();
// Its row of an id that the code names. Throws Error where there is none: a defect of the program.
const CatalogueEffect& effect(std::string_view id);

}  // namespace rotorloop::host
