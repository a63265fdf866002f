#include "bench/diagnose/diagnose.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "bench/diagnose/beliefs.hpp"
#include "bench/diagnose/refit.hpp"
#include "bench/diagnose/residual_findings.hpp"
#include "bench/diagnose/statistics.hpp"
#include "bench/identify/identified_vehicle.hpp"
#include "bench/identify/whiteness.hpp"

namespace rotorloop::bench {
namespace {

using Index = ScoreTable::Index;

// Share of an axis' residual that a free curve over speed, turns, rotor speeds, height and time foretells on other blocks: from here on
// it is a part of the physics that the library lacks.
constexpr double kSystematic = 0.1;

// A candidate with all that the table says of it.
struct Tested {
  const Candidate* candidate = nullptr;
  GroupTest test = {};
  CandidateEvidence evidence = {};
  bool real = false;  // meets every criterion
};

double deflated_bic(const GroupTest& t, double readings) {
  return t.gain - 0.5 * t.degrees * std::log(readings / std::max(1.0, t.inflation));
}

// Two standard errors inside the physical range; a value whose range begins at its neutral point may not be negative by more.
bool inside(const Candidate& c, const GroupTest& t) {
  for (std::size_t k = 0; k < c.parameters.size(); ++k) {
    const auto i = static_cast<Index>(k);
    const double value = c.parameters[k].neutral + t.estimate[i], slack = 2.0 * std::sqrt(std::max(0.0, t.covariance(i, i)));
    if (value < c.parameters[k].min - slack || value > c.parameters[k].max + slack) return false;
  }
  return true;
}

// Largest parameter over the size that matters.
double relevance(const Candidate& c, const Eigen::VectorXd& estimate) {
  double out = 0.0;
  for (std::size_t k = 0; k < c.parameters.size(); ++k)
    out = std::max(out, std::fabs(estimate[static_cast<Index>(k)]) / c.parameters[k].scale);
  return out;
}

Tested examine(const ScoreTable& table, const ColumnSet& model, const Candidate& c) {
  Tested out{.candidate = &c, .test = test_group(table, model, c.columns)};
  const GroupTest& t = out.test;
  CandidateEvidence& e = out.evidence;
  e.id = c.id;
  for (std::size_t k = 0; k < c.parameters.size(); ++k) {
    const auto i = static_cast<Index>(k);
    e.one_step.push_back({c.parameters[k].name, c.parameters[k].unit, c.parameters[k].neutral + t.estimate[i],
                          std::sqrt(std::max(0.0, t.covariance(i, i)))});
  }
  e.chi2 = t.chi2;
  e.wald = t.wald;
  e.degrees = t.degrees;
  e.p = t.p;
  e.gain = t.gain;
  e.gain_relative = 2.0 * t.gain / table.readings;
  e.bic = deflated_bic(t, table.readings);
  e.inside_bounds = inside(c, t);
  if (t.degrees > 0) e.cross_validated = cross_validated_gain(table, model, c.columns, t.inflation);
  e.typical = c.parameters.front().scale;
  e.detectable = t.degrees > 0 ? 3.3 * e.one_step.front().u : 0.0;
  return out;
}

std::string first_failure(const Tested& t, const Criteria& criteria, double placebo) {
  const CandidateEvidence& e = t.evidence;
  if (e.degrees == 0) return "the model's own parameters take all of it";
  if (e.p_holm > criteria.p) return fmt::format("chance: p {:.2g} after Holm", e.p_holm);
  if (e.wald < placebo) return fmt::format("no better than placebos (W {:.1f}, theirs {:.1f})", e.wald, placebo);
  if (!e.inside_bounds) return "outside its physical range";
  if (const double size = relevance(*t.candidate, t.test.estimate); size < criteria.relevant)
    return fmt::format("too small to matter ({:.2f} of a size that does)", size);
  if (e.bic <= 0.0) return fmt::format("its gain ({:.1f}) does not pay for its {} parameters", e.gain, e.degrees);
  if (e.gain < criteria.gain_per_reading * e.gain / std::max(1e-300, 0.5 * e.gain_relative))
    return fmt::format("explains next to nothing ({:.2g} of the misfit)", e.gain_relative);
  if (e.cross_validated < criteria.held_share * e.gain)
    return fmt::format("does not hold on blocks that did not estimate it ({:.1f} of {:.1f})", e.cross_validated, e.gain);
  return {};
}

// All candidates against the model of the table, best first.
std::vector<Tested> examine_all(const Screening& s, const Criteria& criteria, double placebo) {
  std::vector<Tested> all;
  const ColumnSet model = base_columns(s.table);
  for (const Candidate& c : s.candidates) all.push_back(examine(s.table, model, c));
  std::vector<double> p;
  for (const Tested& t : all) p.push_back(t.evidence.p);
  const std::vector<double> adjusted = holm(p);
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].evidence.p_holm = adjusted[i];
    all[i].evidence.ruled_out_by = first_failure(all[i], criteria, placebo);
    all[i].real = all[i].evidence.ruled_out_by.empty();
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Tested& a, const Tested& b) { return a.real != b.real ? a.real : a.evidence.bic > b.evidence.bic; });
  return all;
}

// Which others explain the same: as good a criterion within what chance makes of it, or nearly as good and much alike; and neither
// leaves the other anything to explain.
std::vector<ClassMember> twins_of(const Screening& s, const std::vector<Tested>& all, const Tested& winner, const Criteria& criteria) {
  std::vector<ClassMember> out;
  const ColumnSet model = base_columns(s.table);
  for (const Tested& other : all) {
    if (&other == &winner || other.test.degrees == 0 || !other.evidence.inside_bounds) continue;
    const double behind = winner.evidence.bic - other.evidence.bic;
    if (behind > 2.0 * criteria.twin_bic + 0.02 * winner.evidence.gain) continue;
    const double alike = confounding(s.table, model, winner.candidate->columns, other.candidate->columns);
    if (behind > criteria.twin_bic && alike < criteria.twin_correlation) continue;
    const GroupTest rest = test_group(s.table, with(model, winner.candidate->columns), other.candidate->columns);
    const GroupTest back = test_group(s.table, with(model, other.candidate->columns), winner.candidate->columns);
    // An effect that explains something of its own beside the winner is another effect, not its twin.
    const bool own = rest.degrees > 0 && rest.p < criteria.p && deflated_bic(rest, s.table.readings) > 0.0;
    const bool better = back.degrees > 0 && back.p < criteria.p && deflated_bic(back, s.table.readings) > criteria.twin_bic;
    if (own || better) continue;
    ClassMember m{other.candidate->id, alike, other.evidence.gain / winner.evidence.gain, other.evidence.one_step};
    out.push_back(std::move(m));
  }
  std::stable_sort(out.begin(), out.end(), [](const ClassMember& a, const ClassMember& b) { return a.gain_share > b.gain_share; });
  return out;
}

std::vector<NamedValue> values_in(const Identification& r, const Candidate& c) {
  std::vector<NamedValue> out;
  const auto parameters = parameters_of(c, r.problem.start.terms);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const Estimate* e = r.fit.find(parameters[k]);
    out.push_back({c.parameters[k].name, c.parameters[k].unit, e ? e->value : c.parameters[k].neutral, e ? reported_u(*e) : 0.0});
  }
  return out;
}

// Largest of the parameters over its standard error, and whether one stands at a bound.
double certainty(const Candidate& c, const std::vector<NamedValue>& values) {
  double out = 0.0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (values[k].u > 0.0) out = std::max(out, std::fabs(values[k].value - c.parameters[k].neutral) / values[k].u);
  }
  return out;
}
bool at_bound(const Candidate& c, const std::vector<NamedValue>& values) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    const CandidateParameter& q = c.parameters[k];
    const double slack = 1e-6 * (q.max - q.min);
    const bool low = values[k].value <= q.min + slack && q.min != q.neutral, high = values[k].value >= q.max - slack && q.max != q.neutral;
    if (low || high) return true;
  }
  return false;
}

std::vector<std::pair<std::string, double>> shifts(const Identification& before, const Identification& after) {
  std::vector<std::pair<std::string, double>> out;
  for (const Estimate& a : before.fit.estimates) {
    const Estimate* b = after.fit.find(a.parameter, a.flight);
    if (!b || a.value == 0.0) continue;
    if (std::fabs(b->value - a.value) > reported_u(a)) out.emplace_back(estimate_name(a, before.problem), b->value / a.value - 1.0);
  }
  return out;
}

bool innovations_white(const Identification& r) {
  for (std::size_t f = 0; f < r.fit.reduced.size(); ++f) {
    if (!r.fit.reduced[f].innovations.empty() && !whiteness_of(r.flights[f].name, r.fit.reduced[f].innovations).white()) return false;
  }
  return true;
}

}  // namespace

DiagnosisRun diagnose(const std::vector<FlightToFit>& flights, const host::VehicleFile& vehicle, const DiagnoseOptions& o,
                      const std::function<void(const DiagnoseProgress&)>& progress) {
  const auto say = [&](const std::string& part, double done) {
    if (progress) progress({part, done});
  };
  const int threads = o.identify.fit.threads;
  const host::EffectCatalogue catalogue = host::builtin_effect_catalogue();
  DiagnosisRun out;
  Diagnosis& d = out.diagnosis;

  say("baseline fit", 0.0);
  IdentifyOptions first = o.identify;
  if (o.beliefs) first.beliefs = beliefs;
  first.fit.innovations = true;
  out.before = identify(flights, vehicle, first);
  Identification model = copy_of(out.before);
  FitOptions again = first.fit;
  again.noise.rounds = std::min(again.noise.rounds, 6);  // from where the last fit left it

  std::vector<std::string> without = o.without;
  std::vector<Candidate> added;
  for (int round = 0;; ++round) {
    const double done = 0.3 + 0.6 * round / (o.max_effects + 1.0);
    say("screening", done);
    const Screening s = screen(model, without, o.library, o.block_s, threads);
    const std::vector<double> placebos =
        placebo_statistics(model, s, o.placebos, o.seed + static_cast<std::uint64_t>(round), o.block_s, threads);
    const double limit =
        placebos.empty() ? 0.0
                         : placebos[std::min(placebos.size() - 1, static_cast<std::size_t>(0.99 * static_cast<double>(placebos.size())))];
    std::vector<Tested> all = examine_all(s, o.criteria, limit);
    DiagnosisRound record{.candidates = {}, .placebo_wald = limit, .placebos = placebos.size(), .decision = {}};
    for (const Tested& t : all) record.candidates.push_back(t.evidence);

    bool accepted = false;
    for (const Tested& t : all) {
      if (!t.real || static_cast<int>(added.size()) >= o.max_effects) break;
      say("refit with " + t.candidate->id, done + 0.3 / (o.max_effects + 1.0));
      const auto reject = [&](const std::string& why) {
        CandidateEvidence e = t.evidence;
        e.ruled_out_by = why;
        d.rejected.push_back(std::move(e));
        without.push_back(t.candidate->id);
      };
      Identification next;
      try {
        next = refit_with(model, *t.candidate, t.test.estimate, again);
      } catch (const std::exception& e) {
        reject(std::string("the refit fails: ") + e.what());
        continue;
      }
      const std::vector<NamedValue> values = values_in(next, *t.candidate);
      const double rise = next.fit.log_likelihood - model.fit.log_likelihood;
      const double sure = certainty(*t.candidate, values);
      if (!next.fit.converged) {
        reject("the refit does not converge");
      } else if (at_bound(*t.candidate, values)) {
        reject("the refit ends at the bound of its physical range");
      } else if (rise <= 0.5 * t.test.degrees * std::log(s.table.readings)) {
        reject(fmt::format("the refit raises the log likelihood by {:.1f} only", rise));
      } else if (sure < o.criteria.fewest_u) {
        reject(fmt::format("{:.1f} standard errors after the refit", sure));
      } else {
        AddedEffect a{.id = t.candidate->id, .parameters = values, .twins = twins_of(s, all, t, o.criteria), .evidence = t.evidence};
        a.shifts = shifts(model, next);
        if (const host::EffectFacts* facts = catalogue.facts_of(a.id); facts && !a.twins.empty()) a.manoeuvre = facts->manoeuvre;
        record.decision = fmt::format("added {}", a.id);
        d.added.push_back(std::move(a));
        added.push_back(*t.candidate);
        model = std::move(next);
        accepted = true;
        // What failed beside a model that lacked this may hold beside one that has it.
        without = o.without;
        break;
      }
    }
    if (!accepted) {
      record.decision =
          added.size() >= static_cast<std::size_t>(o.max_effects) ? "as many effects as were allowed" : "nothing passes every criterion";
      for (const Tested& t : all) {
        const double typical = t.evidence.typical;
        if (t.test.degrees == 0 || t.evidence.detectable > typical) {
          const host::EffectFacts* facts = catalogue.facts_of(t.candidate->id);
          d.not_observable.push_back({t.candidate->id,
                                      t.test.degrees == 0
                                          ? "the model's own parameters take all of it"
                                          : fmt::format("only {:.2g} {} would have shown, {:.2g} matters", t.evidence.detectable,
                                                        t.candidate->parameters.front().unit, typical),
                                      facts ? facts->needs + facts->manoeuvre : std::string(), t.evidence.detectable, typical,
                                      t.candidate->parameters.front().unit});
        }
      }
      d.rounds.push_back(std::move(record));
      break;
    }
    d.rounds.push_back(std::move(record));
  }

  // Backward: what the effects found later made needless goes again.
  for (std::size_t i = added.size(); i-- > 0 && added.size() > 1;) {
    const std::vector<NamedValue> values = values_in(model, added[i]);
    if (certainty(added[i], values) >= o.criteria.fewest_u) continue;
    say("refit without " + added[i].id, 0.93);
    model = refit_without(model, added[i], again);
    CandidateEvidence e = d.added[i].evidence;
    e.ruled_out_by = "needless beside what was found after it";
    d.rejected.push_back(std::move(e));
    d.added.erase(d.added.begin() + static_cast<std::ptrdiff_t>(i));
    added.erase(added.begin() + static_cast<std::ptrdiff_t>(i));
  }
  for (std::size_t i = 0; i < added.size(); ++i) d.added[i].parameters = values_in(model, added[i]);

  // What can never be seen in such logs.
  for (std::size_t i = 0; i < catalogue.ids.size(); ++i) {
    const host::EffectFacts& facts = catalogue.facts[i];
    const bool listed =
        std::any_of(d.not_observable.begin(), d.not_observable.end(), [&](const NotObservable& n) { return n.id == catalogue.ids[i]; });
    if (facts.observability == "not_observable" && !listed)
      d.not_observable.push_back({catalogue.ids[i], "does not show in flight logs of this kind", facts.needs, 0.0, 0.0, facts.unit});
  }
  out.after = std::move(model);
  d.white = innovations_white(out.after);
  const bool ambiguous = std::any_of(d.added.begin(), d.added.end(), [](const AddedEffect& a) { return !a.twins.empty(); });
  d.verdict = ambiguous ? DiagnosisVerdict::ambiguous : d.added.empty() ? DiagnosisVerdict::clean : DiagnosisVerdict::named;
  say("done", 1.0);
  return out;
}

void judge_residuals(const ResidualFindings& left, Diagnosis& d) {
  bool real = false;
  for (std::size_t a = 0; a < kAxes; ++a) {
    const ResidualKind kind = left.unexplained.kind[a];
    const AdditiveFit& fit = left.unexplained.axis[a].explainable;
    real = real || kind == ResidualKind::bursts || (kind == ResidualKind::systematic && fit.share > kSystematic);
  }
  if (d.added.empty() && real && !d.white) d.verdict = DiagnosisVerdict::unexplained;
  d.remarks.insert(d.remarks.end(), left.words.begin(), left.words.end());
}

}  // namespace rotorloop::bench
