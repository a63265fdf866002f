#include "bench/sysid/diagnose/candidate.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/error.hpp"
#include "host/effects/term_size.hpp"

namespace rotorloop::diagnose {
namespace {

std::vector<int> parameters_of_fit(const host::CatalogueEffect& e) {
  std::vector<int> out;
  for (const std::string& name : e.fit) {
    out.push_back(estimate::find_parameter(name, {}));
    if (out.back() < 0)
      throw Error({"effects/catalogue.toml", e.id + ".fit names \"" + name + "\", which no fit has", "", "see `identify --names`"});
  }
  return out;
}

std::optional<Candidate> of_fit(const host::CatalogueEffect& e, const identify::Identification& r) {
  const estimate::FitProblem& p = r.problem;
  Candidate c{.id = e.id, .core = parameters_of_fit(e)};
  const auto is_free = [&](const estimate::FreeParameter& f) {
    return std::find(c.core.begin(), c.core.end(), f.parameter) != c.core.end();
  };
  const bool commands =
      std::any_of(p.flights.begin(), p.flights.end(), [](const estimate::GridFlight* g) { return g->input.from_commands(); });
  const bool poses = std::any_of(p.flights.begin(), p.flights.end(), [](const estimate::GridFlight* g) { return !g->pose.empty(); });
  if (std::any_of(p.free.begin(), p.free.end(), is_free) || (c.core.front() == estimate::kRotorDelay && commands) ||
      (c.core.front() == estimate::kPoseDelay && !poses))
    return std::nullopt;
  // What matters of it is what matters of the effect.
  const host::Term* same = host::find_term(e.id);
  const double size = same ? same->info.parameters.front().scale : std::fabs(e.parameter.typical_value);
  for (const int parameter : c.core) {
    const estimate::ParameterInfo info = estimate::parameter_info(parameter, p.start.terms);
    c.parameters.push_back({info.symbol, info.unit, r.fit.values.front()[parameter], info.min, info.max, size > 0.0 ? size : info.scale});
  }
  return c;
}

std::optional<Candidate> of_term(const host::Term& term, const estimate::ModelValues& model) {
  for (std::size_t i = 0; i < model.terms.size(); ++i) {
    if (model.terms.term(i).info.id == term.info.id) return std::nullopt;
  }
  if (!host::can_act(term, model.geometry)) return std::nullopt;
  const double mass_kg = model[estimate::kMass], arm_m = host::arm_m(model.geometry);
  Candidate c{.id = std::string(term.info.id), .term = &term};
  for (const host::TermParameter& t : term.info.parameters)
    c.parameters.push_back(
        {std::string(t.name), std::string(t.unit), t.neutral, t.min, t.max, t.scale * host::size_ratio(t.unit, mass_kg, arm_m)});
  return c;
}

}  // namespace

bool acts_on_body(const Candidate& c) {
  if (!c.term) return c.core.front() != estimate::kPoseDelay;
  const host::TermHooks<double>& h = c.term->plain;
  return h.speeds || h.air || h.inflow || h.rotor || h.body;
}

std::vector<Candidate> candidates_for(const identify::Identification& r, const std::vector<std::string>& without,
                                      std::span<const host::Term* const> library) {
  std::vector<Candidate> out;
  const auto add = [&](std::optional<Candidate> c) {
    if (c && std::find(without.begin(), without.end(), c->id) == without.end()) out.push_back(std::move(*c));
  };
  for (const host::CatalogueEffect& e : host::builtin_effect_catalogue().effects) {
    if (e.kind == host::EffectKind::parameter) add(of_fit(e, r));
  }
  for (const host::Term& term : host::all_terms()) {  // in the order in which they act
    if (host::effect(term.info.id).kind != host::EffectKind::parameter) add(of_term(term, r.problem.start));
  }
  for (const host::Term* term : library) add(of_term(*term, r.problem.start));
  return out;
}

const host::CatalogueEffect& effect_of_parameter(int core_parameter) {
  for (const host::CatalogueEffect& e : host::builtin_effect_catalogue().effects) {
    if (e.kind == host::EffectKind::parameter && parameters_of_fit(e).front() == core_parameter) return e;
  }
  throw Error(
      {"effects/catalogue.toml", "no effect is " + estimate::parameter_info(core_parameter, {}).name, "", "name it in the `fit` of one"});
}

}  // namespace rotorloop::diagnose
