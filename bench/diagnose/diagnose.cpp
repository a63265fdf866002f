#include "bench/diagnose/diagnose.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "bench/diagnose/beliefs.hpp"
#include "bench/diagnose/contest.hpp"
#include "bench/diagnose/gust.hpp"
#include "bench/diagnose/late_poses.hpp"
#include "bench/diagnose/ratios.hpp"
#include "bench/diagnose/residuals/residual_findings.hpp"
#include "bench/identify/identified_vehicle.hpp"
#include "bench/identify/whiteness.hpp"
#include "host/effects/term_size.hpp"

namespace rotorloop::diagnose {
namespace {

// Share of an axis' residual that a free curve over speed, turns, rotor speeds, height and time foretells on other blocks: from here on
// it is a part of the physics that the library lacks.
constexpr double kSystematic = 0.1;
// Missing force over weight, and torque over weight times arm: 33 mN and 1.7 mN m for the reference quadrotor, whose blade-element plant
// leaves 19 mN and 0.4 mN m beyond the terms of this library.
constexpr double kForceMatters = 0.005, kTorqueMatters = 0.002;

std::vector<std::pair<std::string, double>> shifts(const identify::Identification& before, const identify::Identification& after) {
  std::vector<std::pair<std::string, double>> out;
  for (const estimate::Estimate& a : before.fit.estimates) {
    const estimate::Estimate* b = after.fit.find(a.parameter, a.flight);
    if (!b || a.value == 0.0) continue;
    if (std::fabs(b->value - a.value) > identify::reported_u(a)) out.emplace_back(estimate::estimate_name(a, before.problem), b->value / a.value - 1.0);
  }
  return out;
}

bool among(std::string_view id, const std::vector<std::string>& ids) { return std::find(ids.begin(), ids.end(), id) != ids.end(); }

// What the refits say, in the record of the screening. Where none is accepted, no candidate is left standing as if nothing spoke against
// it.
void note_refits(const std::vector<Contestant>& field, DiagnosisRound& record) {
  const bool accepted = !field.empty() && field.front().failure.empty();
  for (CandidateEvidence& e : record.candidates) {
    const auto c = std::find_if(field.begin(), field.end(), [&](const Contestant& one) { return one.tested->candidate->id == e.id; });
    const auto stands_for_it = [&](const Contestant& one) {
      return std::any_of(one.same.begin(), one.same.end(), [&](const Tested* t) { return t->candidate->id == e.id; });
    };
    if (c != field.end()) {
      e.rise = c->rise;
      e.variation = c->even.variation;
      e.scatter = c->even.scatter;
      if (e.ruled_out_by.empty()) e.ruled_out_by = c->failure;
    } else if (const auto same = std::find_if(field.begin(), field.end(), stands_for_it); same != field.end()) {
      if (e.ruled_out_by.empty() && !same->failure.empty())
        e.ruled_out_by = fmt::format("as {}: {}", same->tested->candidate->id, same->failure);
    } else if (e.ruled_out_by.empty() && !accepted) {
      e.ruled_out_by = "not refitted: those that explain more were, and failed";
    }
  }
}

// What the file is wrong about is no effect that the model lacks, and yet changes what it foretells.
void note_contradictions(const identify::Identification& model, Diagnosis& d) {
  constexpr std::size_t kMost = 5;
  const std::vector<Contradiction> all = contradictions(model.problem, model.fit);
  for (std::size_t i = 0; i < std::min(kMost, all.size()); ++i) {
    const Contradiction& c = all[i];
    const estimate::ParameterInfo info = estimate::parameter_info(c.parameter, model.problem.start.terms);
    d.remarks.push_back(
        fmt::format("The flights contradict what the file knows of {}: {:.4g} ± {:.2g} {} there, {:.4g} ± {:.2g} with them ({:.1f} "
                    "standard deviations).",
                    info.name, c.believed, c.believed_u, info.unit, c.found, c.found_u, std::fabs(c.z)));
  }
}

// What it takes to see an effect: what is needed beside such logs, and the flight.
std::string needs_of(const host::EffectFacts& facts) {
  return facts.needs + (facts.needs.empty() || facts.manoeuvre.empty() ? "" : "; ") + facts.manoeuvre;
}

bool innovations_white(const identify::Identification& r) {
  for (std::size_t f = 0; f < r.fit.reduced.size(); ++f) {
    if (!r.fit.reduced[f].innovations.empty() && !identify::whiteness_of(r.flights[f].name, r.fit.reduced[f].innovations).white()) return false;
  }
  return true;
}

}  // namespace

DiagnosisRun diagnose(const std::vector<identify::FlightToFit>& flights, const host::VehicleFile& vehicle, const DiagnoseOptions& o,
                      const std::function<void(const DiagnoseProgress&)>& progress) {
  const auto say = [&](const std::string& part, double done) {
    if (progress) progress({part, done});
  };
  const int threads = o.identify.fit.threads;
  const host::EffectCatalogue catalogue = host::builtin_effect_catalogue();
  DiagnosisRun out;
  Diagnosis& d = out.diagnosis;

  say("baseline fit", 0.0);
  identify::IdentifyOptions first = o.identify;
  if (o.beliefs) first.beliefs = beliefs;
  first.fit.innovations = true;
  out.before = identify::identify(flights, vehicle, first);
  identify::Identification model = copy_of(out.before);
  estimate::FitOptions again = first.fit;
  again.noise.rounds = std::min(again.noise.rounds, 4);  // from where the last fit left it
  again.tolerance = std::max(again.tolerance, 0.01);     // of a log likelihood that is compared in whole numbers

  std::vector<Candidate> added;
  RisesBefore risen;
  for (int round = 0;; ++round) {
    const double done = 0.3 + 0.6 * round / (o.max_effects + 1.0);
    say("screening", done);
    const identify::Identification start = at_beliefs(model, again);
    const Screening s = screen(start, o.without, o.library, o.block_s, threads);
    const std::vector<double> placebos =
        placebo_statistics(start, s, o.placebos, o.seed + static_cast<std::uint64_t>(round), o.block_s, threads);
    const double limit =
        placebos.empty() ? 0.0
                         : placebos[std::min(placebos.size() - 1, static_cast<std::size_t>(0.99 * static_cast<double>(placebos.size())))];
    std::vector<Tested> all = examine_all(s, o.criteria, limit);
    DiagnosisRound record{.candidates = {}, .placebo_wald = limit, .placebos = placebos.size(), .decision = {}};
    for (const Tested& t : all) record.candidates.push_back(t.evidence);

    bool accepted = false;
    if (static_cast<int>(added.size()) < o.max_effects) {
      say("refits of what could be it", done + 0.3 / (o.max_effects + 1.0));
      std::vector<Contestant> field = contest(start, model, s, all, o.criteria, again);
      if (!field.empty() && !among("wind_dryden", o.without)) leave_to_gusts(score_gust(start), field);
      for (Contestant& c : field) {
        if (c.failure.empty() && too_little_beside(risen, c, o.criteria))
          c.failure = fmt::format("raises the log likelihood by {:.1f}, next to {:.1f} by what was found before", c.rise, risen.any);
      }
      std::stable_partition(field.begin(), field.end(), [](const Contestant& c) { return c.failure.empty(); });
      note_refits(field, record);
      for (const Contestant& c : field) {
        if (c.failure.empty()) continue;
        d.rejected.push_back(c.tested->evidence);
        d.rejected.back().ruled_out_by = c.failure;
      }
      if (!field.empty() && field.front().failure.empty()) {
        Contestant& winner = field.front();
        AddedEffect a{.id = winner.tested->candidate->id,
                      .parameters = winner.values,
                      .twins = twins_of(s, all, field, o.criteria),
                      .evidence = winner.tested->evidence};
        a.evidence.rise = winner.rise;
        a.evidence.variation = winner.even.variation;
        a.evidence.scatter = winner.even.scatter;
        a.shifts = shifts(model, winner.refit.fit);
        if (const host::EffectFacts* facts = catalogue.facts_of(a.id); facts && !a.twins.empty()) a.manoeuvre = facts->manoeuvre;
        record.decision = fmt::format("added {}", a.id);
        risen.count(winner);
        d.added.push_back(std::move(a));
        added.push_back(*winner.tested->candidate);
        model = std::move(winner.refit.fit);
        accepted = true;
      }
    }
    if (!accepted) {
      record.decision =
          added.size() >= static_cast<std::size_t>(o.max_effects) ? "as many effects as were allowed" : "nothing passes every criterion";
      for (const Tested& t : all) {
        const double typical = t.evidence.typical;
        if (t.test.degrees == 0 || t.evidence.detectable > typical) {
          const host::EffectFacts* facts = catalogue.facts_of(t.candidate->id);
          d.not_observable.push_back(
              {t.candidate->id,
               t.test.degrees == 0 ? "the model's own parameters take all of it"
                                   : fmt::format("only {:.2g} {} would have shown, {:.2g} matters", t.evidence.detectable,
                                                 t.candidate->parameters.front().unit, typical),
               facts ? needs_of(*facts) : std::string(), t.evidence.detectable, typical, t.candidate->parameters.front().unit});
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
  for (std::size_t i = 0; i < added.size(); ++i) {
    d.added[i].parameters = values_in(model, added[i]);
    for (const int p : parameters_of(added[i], model.problem.start.terms)) {
      const std::vector<NamedValue> ratios = firm_ratios(model.fit, p, model.problem.start.terms);
      d.added[i].ratios.insert(d.added[i].ratios.end(), ratios.begin(), ratios.end());
    }
  }

  // Where the user held the delay it was a candidate like any other.
  const bool was_candidate =
      std::any_of(added.begin(), added.end(), [](const Candidate& c) { return c.core == std::vector<int>{estimate::kPoseDelay}; });
  if (auto late = late_poses(model.fit, o.criteria); late && !was_candidate) d.added.insert(d.added.begin(), std::move(*late));

  // What cannot be seen in such logs as a rule, unless it was.
  for (std::size_t i = 0; i < catalogue.ids.size(); ++i) {
    const host::EffectFacts& facts = catalogue.facts[i];
    const auto is_it = [&](const auto& one) { return one.id == catalogue.ids[i]; };
    const bool listed = std::any_of(d.not_observable.begin(), d.not_observable.end(), is_it),
               found = std::any_of(d.added.begin(), d.added.end(), is_it);
    if (facts.observability == "not_observable" && !listed && !found)
      d.not_observable.push_back({catalogue.ids[i], "does not show in flight logs of this kind", facts.needs, 0.0, 0.0, facts.unit});
  }
  note_contradictions(model, d);
  out.after = std::move(model);
  d.white = innovations_white(out.after);
  const bool ambiguous = std::any_of(d.added.begin(), d.added.end(), [](const AddedEffect& a) { return !a.twins.empty(); });
  d.verdict = ambiguous ? DiagnosisVerdict::ambiguous : d.added.empty() ? DiagnosisVerdict::clean : DiagnosisVerdict::named;
  say("done", 1.0);
  return out;
}

namespace {

// Effects that change the scatter and not the mean: named when the mean is as the model has it, and when they matter. One that flights
// like these cannot show for certain stays a remark, and so does what is found after the first: it shares its blocks.
void add_scatter(const VarianceResult& variance, const std::vector<std::string>& without, Diagnosis& d) {
  const host::EffectCatalogue catalogue = host::builtin_effect_catalogue();
  for (const VarianceEffect& v : variance.effects) {
    const host::EffectFacts* facts = catalogue.facts_of(v.id);
    const host::CatalogueParameter* typical = catalogue.parameter_of(v.id);
    if (!v.found || !facts || !typical || facts->observability == "not_observable" || among(v.id, without)) continue;
    const double matters = kScatterMatters * std::fabs(typical->typical_value);
    if (v.size < matters) continue;
    CandidateEvidence e;
    e.id = v.id;
    e.one_step = {{v.parameter, v.unit, v.size, v.u}};
    e.wald = v.t * v.t;
    e.degrees = 1;
    e.p = v.p;
    e.p_holm = v.p_holm;
    e.typical = matters;
    AddedEffect a{.id = v.id, .parameters = e.one_step, .evidence = e};
    for (const auto& [twin, correlation] : v.twins) {
      if (catalogue.facts_of(twin)) a.twins.push_back({twin, correlation, 1.0, {}});
    }
    if (!a.twins.empty()) a.manoeuvre = facts->manoeuvre;
    d.added.push_back(std::move(a));
    return;
  }
}

}  // namespace

void judge_residuals(const ResidualFindings& left, const estimate::ModelValues& vehicle, Diagnosis& d, const std::vector<std::string>& without) {
  const double weight_N = vehicle[estimate::kMass] * host::kGravity_m_s2, arm_m = host::arm_m(vehicle.geometry);
  for (std::size_t a = 0; a < kAxes; ++a) {
    const AxisUnexplained& axis = left.unexplained.axis[a];
    const double beyond = std::sqrt(std::max(0.0, axis.rms * axis.rms - axis.rms_expected * axis.rms_expected));
    const double matters = a < 3 ? kForceMatters * weight_N : kTorqueMatters * weight_N * arm_m;
    const bool bursts = left.unexplained.kind[a] == ResidualKind::bursts;
    const bool systematic = left.unexplained.kind[a] == ResidualKind::systematic && axis.explainable.share > kSystematic;
    if (beyond > matters && (bursts || systematic)) {
      d.remains.push_back({std::string(kAxisNames[a]), std::string(kAxisUnits[a]), bursts,
                           bursts ? axis.burst_share : axis.explainable.share, beyond, matters});
    }
  }
  if (d.added.empty()) {
    add_scatter(left.variance, without, d);
    if (!d.added.empty()) {
      d.verdict = DiagnosisVerdict::named;
      std::erase_if(d.remains, [](const RemainingResidual& r) { return r.bursts; });  // what gusts do
    } else if (!d.remains.empty()) {
      d.verdict = DiagnosisVerdict::unexplained;
    }
  }
  d.remarks.insert(d.remarks.end(), left.words.begin(), left.words.end());
}

}  // namespace rotorloop::diagnose
