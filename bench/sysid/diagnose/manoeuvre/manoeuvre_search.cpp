#include "bench/sysid/diagnose/manoeuvre/manoeuvre_search.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "bench/sysid/diagnose/score_table.hpp"
#include "bench/sysid/estimate/chain.hpp"
#include "bench/sysid/estimate/fit_layout.hpp"
#include "host/base/parallel.hpp"

namespace rotorloop::diagnose {
namespace {

using Index = ScoreTable::Index;
using Eigen::MatrixXd;

constexpr double kDistinguished_log = 3.0;  // log units that separate two effects: odds of 20 to 1 …
constexpr double kPatience = 6;             // … within so many repetitions of a manoeuvre

// A member as columns of the table: its parameters in the model that holds all members, and how far each stands from its absence.
struct Part {
  std::string id;
  std::vector<int> parameters;
  Eigen::VectorXd size;
  ColumnSet columns;
};

// The fitted model with every member in it at its size.
struct ClassModel {
  std::vector<estimate::ModelValues> values;  // of each flight
  std::vector<Part> parts;
  estimate::Columns columns;                  // free parameters of the fit, then those of members that the fit holds
  std::vector<estimate::FreeParameter> free;  // of each column
};

const host::Term* term_of(const std::string& id, const std::vector<const host::Term*>& library) {
  for (const host::Term* t : library) {
    if (t->info.id == id) return t;
  }
  return host::find_term(id);
}

std::optional<std::size_t> place_in(const host::TermList& terms, const std::string& id) {
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (terms.term(t).info.id == id) return t;
  }
  return std::nullopt;
}

// Parameters of the fit itself that a member names, as symbols; empty when it is a term.
std::vector<int> core_parameters(const Member& m) {
  std::vector<int> out;
  for (const NamedValue& v : m.parameters) {
    const int p = estimate::find_parameter(v.name, {});
    if (p < 0) return {};
    out.push_back(p);
  }
  return out;
}

ClassModel class_model(const identify::Identification& fitted, const identify::Identification& before, std::span<const Member> members,
                       const std::vector<const host::Term*>& library) {
  ClassModel out;
  out.values = fitted.fit.values;
  out.free = fitted.problem.free;
  for (const estimate::FreeParameter& f : out.free) out.columns.push_back(f.parameter);
  for (const Member& m : members) {
    Part part{.id = m.id, .parameters = {}, .size = Eigen::VectorXd::Zero(static_cast<Index>(m.parameters.size())), .columns = {}};
    const host::TermList& terms = out.values.front().terms;
    const auto present = place_in(terms, m.id);
    const std::vector<int> core = present ? std::vector<int>{} : core_parameters(m);
    const host::Term* term = present ? &terms.term(*present) : term_of(m.id, library);
    const bool first = &m == &members.front();
    if ((present && !first) || (core.empty() && (!term || term->info.parameters.size() != m.parameters.size()))) continue;
    if (!core.empty()) {
      part.parameters = core;
      for (std::size_t k = 0; k < core.size(); ++k) {
        part.size[static_cast<Index>(k)] = m.parameters[k].value - before.fit.values.front()[core[k]];
        for (estimate::ModelValues& v : out.values) v[core[k]] = m.parameters[k].value;
      }
    } else {
      std::size_t at = present ? terms.first_parameter(*present) : 0;
      if (!present) {
        bool fits = true;
        for (estimate::ModelValues& v : out.values) {
          fits = v.terms.add(*term) && fits;
          at = v.terms.first_parameter(v.terms.size() - 1);
          for (const NamedValue& p : m.parameters) v.values.push_back(p.value);
          v.values.resize(estimate::kCoreParameters + v.terms.parameters(), 0.0);
        }
        if (!fits) continue;
      }
      for (std::size_t k = 0; k < m.parameters.size(); ++k) {
        part.parameters.push_back(estimate::kCoreParameters + static_cast<int>(at + k));
        // Where the first parameter is a factor of all, the others say nothing of whether the effect is there.
        if (k == 0 || term->info.scan.empty()) part.size[static_cast<Index>(k)] = m.parameters[k].value - term->info.parameters[k].neutral;
      }
    }
    for (const int p : part.parameters) {
      if (std::find(out.columns.begin(), out.columns.end(), p) != out.columns.end()) continue;
      out.columns.push_back(p);
      out.free.push_back({p});
    }
    out.parts.push_back(std::move(part));
  }
  return out;
}

MatrixXd information_of(const estimate::GridFlight& g, const std::vector<estimate::BodyState>& at, const estimate::ModelValues& values,
                        const estimate::NoiseModel& noise, const estimate::Columns& columns) {
  std::vector<estimate::BodyState> states = at;
  estimate::Chain chain(g, states, at);
  return chain.sweep(estimate::Residuals(g, values, noise, columns), {.keep_factors = false}).information;
}

// Log likelihood by which `truth`, at its size, beats `rival` on what this information stands for.
double lead(const MatrixXd& information, const ColumnSet& model, const Part& truth, const Part& rival) {
  ScoreTable t;
  t.information = information;
  t.score = -information(Eigen::all, truth.columns) * truth.size;  // of the model without it, where it is true
  return 0.5 * test_group(t, with(model, rival.columns), truth.columns).chi2;
}

// All that the flights so far and the class say; manoeuvres are weighed against it.
struct Evidence {
  const ClassModel& model;
  const estimate::Layout& layout;
  ColumnSet base;  // columns of the model without members
  MatrixXd past;   // information of the flights and of what was known before them
};

// What a manoeuvre, flown by the fitted model and seen by the one with all members, would add to the evidence.
std::optional<ManoeuvreValue> value_of(const Manoeuvre& manoeuvre, const Evidence& e, const ManoeuvreSetting& setting,
                                       const SearchOptions& o) {
  const std::optional<ManoeuvreFlight> f = flown(manoeuvre, setting, o.duration_s);
  if (!f) return std::nullopt;
  estimate::ModelValues seen = e.model.values.front();
  std::copy(f->values.values.begin(), f->values.values.end(), seen.values.begin());
  seen.geometry = f->values.geometry;
  for (const Part& part : e.model.parts) {
    for (const int parameter : part.parameters) seen[parameter] = e.model.values.front()[parameter];
  }
  MatrixXd with_it = e.past;
  const std::vector<Index>& at = e.layout.of_flight.back();
  with_it(at, at) += information_of(f->flight, f->states, seen, f->noise, e.model.columns);
  ManoeuvreValue v{.id = manoeuvre.id, .words = manoeuvre_words(manoeuvre, setting.length_ratio, f->share), .separation = {}};
  for (std::size_t b = 1; b < e.model.parts.size(); ++b) {
    const Part &best = e.model.parts.front(), &alias = e.model.parts[b];
    const auto gained_by = [&](const Part& truth, const Part& rival) {
      return lead(with_it, e.base, truth, rival) - lead(e.past, e.base, truth, rival);
    };
    const double gained = std::min(gained_by(best, alias), gained_by(alias, best));
    v.separation.push_back(std::max(0.0, gained) / o.inflation);
  }
  return v;
}

// Which aliases some manoeuvre can separate, and the manoeuvres by the least separation of any of those.
void rank(const ClassModel& model, ManoeuvreAdvice& out) {
  std::vector<bool> separable;
  for (std::size_t b = 0; b + 1 < model.parts.size(); ++b) {
    double most = 0.0;
    for (const ManoeuvreValue& v : out.ranked) most = std::max(most, v.separation[b]);
    out.aliases.push_back(model.parts[b + 1].id);
    out.reached.push_back(most);
    separable.push_back(kPatience * most * kManoeuvre_s / out.seconds >= kDistinguished_log);
    if (!separable.back()) out.open.push_back(out.aliases.back());
  }
  for (ManoeuvreValue& v : out.ranked) {
    bool some = false;
    for (std::size_t b = 0; b < separable.size(); ++b) {
      if (!separable[b]) continue;
      v.least = some ? std::min(v.least, v.separation[b]) : v.separation[b];
      some = true;
    }
  }
  std::stable_sort(out.ranked.begin(), out.ranked.end(),
                   [](const ManoeuvreValue& a, const ManoeuvreValue& b) { return a.least > b.least; });
}

}  // namespace

ManoeuvreAdvice rank_manoeuvres(const identify::Identification& fitted, const identify::Identification& before,
                                std::span<const Member> members, const SearchOptions& o) {
  ManoeuvreAdvice out{.seconds = o.duration_s, .aliases = {}, .reached = {}, .open = {}, .ranked = {}, .impossible = {}};
  ClassModel model = class_model(fitted, before, members, o.library);
  const estimate::FitProblem& p = fitted.problem;
  const std::size_t flights = p.flights.size();
  estimate::FitProblem wider{.start = model.values.front(),
                             .free = model.free,
                             .flights = p.flights,
                             .noise = p.noise,
                             .flight_noise = {},
                             .flight_start = {},
                             .priors = p.priors};
  wider.flights.push_back(nullptr);  // that of the manoeuvre
  const estimate::Layout layout = estimate::make_layout(wider);
  Evidence evidence{model, layout, {}, {}};
  for (Index i = 0; i < static_cast<Index>(layout.estimates.size()); ++i) evidence.base.push_back(i);
  for (Part& part : model.parts) {
    for (const int parameter : part.parameters) {
      const auto c = static_cast<std::size_t>(std::find(model.columns.begin(), model.columns.end(), parameter) - model.columns.begin());
      part.columns.push_back(layout.of_flight.front()[c]);
      std::erase(evidence.base, part.columns.back());
    }
  }
  if (model.parts.size() < 2 || model.parts.front().id != members.front().id) return out;

  std::vector<MatrixXd> each(flights);
  parallel_for(flights, o.threads, [&](std::size_t f) {
    each[f] = information_of(*p.flights[f], fitted.fit.states[f], model.values[f], fitted.fit.noise[f], model.columns);
  });
  evidence.past = estimate::Priors(wider, layout).information();
  for (std::size_t f = 0; f < flights; ++f) evidence.past(layout.of_flight[f], layout.of_flight[f]) += each[f];

  const ManoeuvreSetting setting = manoeuvre_setting(fitted);
  const std::span<const Manoeuvre> all = manoeuvres();
  std::vector<std::optional<ManoeuvreValue>> values(all.size());
  parallel_for(all.size(), o.threads, [&](std::size_t i) { values[i] = value_of(all[i], evidence, setting, o); });
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (values[i]) {
      out.ranked.push_back(std::move(*values[i]));
    } else {
      out.impossible.emplace_back(all[i].id);
    }
  }
  rank(model, out);
  return out;
}

namespace {

// What to fly, in words.
std::string sentence(const ManoeuvreAdvice& a, const std::string& id, const std::string& of_catalogue) {
  const auto separations = [&](const ManoeuvreValue& v) {
    std::vector<std::string> out;
    for (std::size_t b = 0; b < a.aliases.size(); ++b) {
      if (std::find(a.open.begin(), a.open.end(), a.aliases[b]) == a.open.end())
        out.push_back(fmt::format("{:.2g} from {}", v.separation[b], a.aliases[b]));
    }
    return out;
  };
  std::string out;
  if (a.open.size() < a.aliases.size()) {
    const ManoeuvreValue& best = a.ranked.front();
    out = fmt::format("{}: {:.0f} s are expected to separate {} by a Δ log-likelihood of {}", best.words, a.seconds, id,
                      fmt::join(separations(best), ", "));
    if (a.ranked.size() > 1) out += fmt::format("; or {} ({})", a.ranked[1].words, fmt::join(separations(a.ranked[1]), ", "));
  }
  if (!a.open.empty()) {
    out += fmt::format("{}no manoeuvre of {} tried separates it from {} in a minute with these sensors", out.empty() ? "" : "; ",
                       a.ranked.size(), fmt::join(a.open, ", "));
    if (!of_catalogue.empty()) out += "; the catalogue advises: " + of_catalogue;
  }
  return out;
}

}  // namespace

void choose_manoeuvres(DiagnosisRun& run, const std::vector<const host::Term*>& library, int threads, estimate::StopFit stop) {
  for (AddedEffect& a : run.diagnosis.added) {
    if (a.aliases.empty()) continue;
    stop.check();
    std::vector<Member> members{{a.id, a.parameters}};
    for (const ClassMember& m : a.aliases) members.push_back({m.id, m.parameters});
    const double inflation = a.evidence.gain > 0.0 ? std::max(1.0, 0.5 * a.evidence.chi2 / a.evidence.gain) : 1.0;
    a.advice = rank_manoeuvres(run.after, run.before, members, {.inflation = inflation, .threads = threads, .library = library});
    if (a.advice.aliases.empty()) continue;  // all of them stand in the model by now
    const host::CatalogueEffect* row = host::builtin_effect_catalogue().find(a.id);
    a.manoeuvre = sentence(a.advice, a.id, row ? row->manoeuvre : std::string());
  }
}

}  // namespace rotorloop::diagnose
