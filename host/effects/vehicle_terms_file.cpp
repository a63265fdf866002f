#include "host/effects/vehicle_terms_file.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::host {

namespace {

bool is_load(const Term& t) { return t.plain.speeds || t.plain.air || t.plain.inflow || t.plain.rotor || t.plain.body; }

std::string names_of(std::span<const TermParameter> parameters) {
  std::string out;
  for (const TermParameter& p : parameters) out += (out.empty() ? "" : ", ") + std::string(p.name);
  return out;
}

std::vector<double> values_of(const VehicleEffect& effect, const Term& term, const std::string& where) {
  const auto parameters = term.info.parameters;
  std::vector<double> values;
  for (const TermParameter& p : parameters) values.push_back(p.neutral);
  for (const EffectParameter& given : effect.parameters) {
    const bool start =
        std::any_of(term.info.memory.begin(), term.info.memory.end(), [&](const TermMemory& m) { return m.start.name == given.name; });
    if (start) continue;  // of the flights it was identified from
    const auto at = std::find_if(parameters.begin(), parameters.end(), [&](const TermParameter& p) { return p.name == given.name; });
    if (at == parameters.end())
      throw Error({where, fmt::format("effect \"{}\" has no parameter \"{}\"", effect.id, given.name), "a file of another rotorloop",
                   fmt::format("its parameters are: {}", names_of(parameters))});
    const double value = given.quantity.value;
    if (!(value >= at->min && value <= at->max))
      throw Error({where,
                   fmt::format("effect {}: {} = {} {} is outside [{}, {}]", effect.id, at->name, number_text(value), at->unit,
                               number_text(at->min), number_text(at->max)),
                   "a slipped unit, or a fit that put another effect's work on this one", "leave the effect out or identify it again"});
    values[static_cast<std::size_t>(at - parameters.begin())] = value;
  }
  return values;
}

}  // namespace

FileTerms terms_of(const VehicleFile& vehicle, const std::string& where) {
  FileTerms out;
  for (const VehicleEffect& effect : vehicle.effects) {
    const Term* term = find_term(effect.id);
    if (!term || !is_load(*term)) out.not_flown.push_back(effect.id);
  }
  for (const Term& term : all_terms()) {  // the order in which loads come about, whatever the file's
    for (const VehicleEffect& effect : vehicle.effects) {
      if (effect.id != term.info.id || !is_load(term)) continue;
      if (!out.terms.add(term, values_of(effect, term, where)))
        throw Error({where, fmt::format("effect \"{}\" cannot be added", effect.id), "it occurs twice, or the file has too many",
                     fmt::format("give each effect once, at most {}", kMaxTerms - 1)});
    }
  }
  return out;
}

}  // namespace rotorloop::host
