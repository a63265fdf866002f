#include "bench/sysid/diagnose/diagnose.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/render/digits.hpp"
#include "bench/sysid/diagnose/gust.hpp"
#include "bench/sysid/diagnose/law_remainder.hpp"
#include "bench/sysid/diagnose/manoeuvre/manoeuvre_search.hpp"
#include "bench/sysid/diagnose/model_selection.hpp"
#include "bench/sysid/diagnose/placebos.hpp"
#include "bench/sysid/diagnose/pose_time_offset.hpp"
#include "bench/sysid/diagnose/ratios.hpp"
#include "bench/sysid/diagnose/vehicle_priors.hpp"
#include "bench/sysid/diagnose/wald.hpp"
#include "bench/sysid/identify/gauge.hpp"
#include "bench/sysid/identify/identified_vehicle.hpp"
#include "bench/sysid/identify/whiteness.hpp"
#include "host/base/constants.hpp"
#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"
#include "host/effects/rotor_groups.hpp"
#include "host/effects/slung_load.hpp"
#include "host/effects/surroundings.hpp"
#include "host/effects/term_size.hpp"

namespace rotorloop::diagnose {
namespace {

std::vector<std::pair<std::string, double>> shifts(const identify::Identification& before, const identify::Identification& after) {
  std::vector<std::pair<std::string, double>> out;
  for (const estimate::Estimate& a : before.fit.estimates) {
    const estimate::Estimate* b = after.fit.find(a.parameter, a.flight);
    if (!b || a.value == 0.0) continue;
    if (std::fabs(b->value - a.value) > identify::reported_u(a))
      out.emplace_back(estimate::estimate_name(a, before.problem), b->value / a.value - 1.0);
  }
  return out;
}

bool among(std::string_view id, const std::vector<std::string>& ids) { return std::find(ids.begin(), ids.end(), id) != ids.end(); }

// What the refits say, in the record of the screening. Where none is accepted, no candidate is left standing as if nothing spoke against
// it.
void note_refits(const std::vector<RefitCandidate>& ranked, DiagnosisRound& record) {
  const bool accepted = !ranked.empty() && ranked.front().failure.none();
  for (CandidateEvidence& e : record.candidates) {
    const auto c = std::find_if(ranked.begin(), ranked.end(), [&](const RefitCandidate& one) { return one.tested->candidate->id == e.id; });
    const auto stands_for_it = [&](const RefitCandidate& one) {
      return std::any_of(one.same.begin(), one.same.end(), [&](const Tested* t) { return t->candidate->id == e.id; });
    };
    if (c != ranked.end()) {
      e.delta_log_likelihood = c->delta_log_likelihood;
      e.optimism = c->optimism;
      e.relative_size = c->relative_size;
      e.variation = c->heterogeneity.variation;
      e.scatter = c->heterogeneity.scatter;
      if (e.ruled_out_by.none() || c->failure.none()) e.ruled_out_by = c->failure;  // the refit has the last word for what it finds
    } else if (const auto same = std::find_if(ranked.begin(), ranked.end(), stands_for_it); same != ranked.end()) {
      if (e.ruled_out_by.none() && !same->failure.none()) {
        e.ruled_out_by = same->failure;
        e.ruled_out_by.as = same->tested->candidate->id;
      }
    } else if (e.ruled_out_by.none() && !accepted) {
      e.ruled_out_by = {Rejection::not_refitted};
    }
  }
}

// What was not judged may be what is missing.
void note_unfinished(const std::vector<RefitCandidate>& ranked, Diagnosis& d) {
  for (const RefitCandidate& c : ranked) {
    if (c.failure.id != Rejection::out_of_time) continue;
    d.remarks.push_back(fmt::format("{} was not judged: its refit was not done after {:.0f} s. With --refit-limit it gets more.",
                                    c.tested->candidate->id, c.failure.figures.front().value));
  }
}

// A prior that is wrong is no effect that the model lacks, and yet changes what the model predicts.
void note_contradictions(const identify::Identification& model, Diagnosis& d) {
  constexpr std::size_t kMostReported = 5;
  const std::vector<Contradiction> all = contradictions(model.problem, model.fit);
  for (std::size_t i = 0; i < std::min(kMostReported, all.size()); ++i) {
    const Contradiction& c = all[i];
    const estimate::ParameterInfo info = estimate::parameter_info(c.parameter, model.problem.start.terms);
    d.remarks.push_back(fmt::format(
        "The flights contradict what the file knows of {}: {} {} there, {} with them ({:.1f} "
        "standard deviations).",
        info.name, render::measured_text(c.prior, c.prior_u), info.unit, render::measured_text(c.found, c.found_u), std::fabs(c.z)));
  }
}

// A gate that stands lower than it was meant to, or not at all, is no secret.
void note_placebos(const Criteria& criteria, Diagnosis& d) {
  const double level = 1.0 - criteria.chance;
  const PlaceboLimit& first = d.rounds.front().placebos;
  if (first.placebos == 0) {
    d.remarks.push_back("No placebos: the only test against chance is the scatter between blocks of the flights (p after Holm).");
  } else if (first.level < level) {
    d.remarks.push_back(fmt::format("{} placebos are too few for a level of {:.0f} %: their largest is one of {:.1f} %.", first.placebos,
                                    100.0 * level, 100.0 * first.level));
  }
}

// Which streams the fit read: what could be seen depends on them.
std::string measurements_used(const identify::Identification& r) {
  const auto any = [&](auto estimate::GridFlight::*list) {
    return std::any_of(r.flights.begin(), r.flights.end(), [&](const estimate::GridFlight& g) { return !(g.*list).empty(); });
  };
  std::vector<std::string_view> used;
  if (any(&estimate::GridFlight::pose)) used.push_back("poses");
  if (any(&estimate::GridFlight::position)) used.push_back("positions");
  if (any(&estimate::GridFlight::velocity)) used.push_back("velocities");
  if (any(&estimate::GridFlight::gyro)) used.push_back("gyro");
  if (any(&estimate::GridFlight::accel)) used.push_back("accelerometer");
  if (any(&estimate::GridFlight::load_W_m)) used.push_back("place of the load");
  return fmt::format("Measurements used: {}.", fmt::join(used, ", "));
}

// What it takes to see an effect: what is needed beside such logs, and the flight.
std::string needs_of(const host::CatalogueEffect& e) {
  return e.needs + (e.needs.empty() || e.manoeuvre.empty() ? "" : "; ") + e.manoeuvre;
}

bool innovations_white(const identify::Identification& r) {
  for (std::size_t f = 0; f < r.fit.reduced.size(); ++f) {
    if (!r.fit.reduced[f].innovations.empty() && !identify::whiteness_of(r.flights[f].name, r.fit.reduced[f].innovations).white())
      return false;
  }
  return true;
}

// A diagnosis under way: the model so far, the effects in it, and what is reported of them.
class Search {
 public:
  Search(const DiagnoseOptions& options, const estimate::FitOptions& fit, const identify::Identification& before, Diagnosis& diagnosis)
      : o_(options), again_(fit), d_(diagnosis), model_(copy_of(before)) {
    again_.noise.rounds = std::min(again_.noise.rounds, 4);  // from where the last fit left it
    again_.tolerance = std::max(again_.tolerance, 0.01);     // of a log likelihood that is compared in whole numbers
  }

  using Say = std::function<void(const std::string& part, double done)>;
  bool add_the_best(int round, const Say& say);  // false: nothing more is to be added
  void drop_the_needless(const Say& say);
  void report_sizes();
  void report_pose_time_offset();
  void report_unobservable_in_flight();
  identify::Identification model() && { return std::move(model_); }

 private:
  std::vector<RefitCandidate> refitted(const identify::Identification& start, const Screening& screening, const std::vector<Tested>& all,
                                       const std::function<void(const std::string&, double)>& progress) const;
  bool stood_for_another(std::size_t i, double own) const;
  void reject(const std::vector<RefitCandidate>& ranked);
  void accept(RefitCandidate& best, std::vector<ClassMember> aliases);
  void report_detection_limits(const std::vector<Tested>& all);

  const DiagnoseOptions& o_;
  const host::EffectCatalogue& catalogue_ = host::builtin_effect_catalogue();
  estimate::FitOptions again_;
  Diagnosis& d_;
  identify::Identification model_;
  std::vector<Candidate> added_;
};

bool Search::add_the_best(int round, const Say& say) {
  const double share = 1.0 / (o_.max_effects + 1.0), done = 0.3 + 0.6 * round * share;
  say("screening", done);
  const int threads = o_.identify.fit.threads;
  again_.stop.check();
  const identify::Identification start = at_priors(model_, again_);
  again_.stop.check();
  const Screening s = screen(start, o_.without, o_.library, o_.block_s, threads, again_.stop);
  const std::vector<double> placebos =
      placebo_statistics(start, s, o_.placebos, o_.seed + static_cast<std::uint64_t>(round), o_.block_s, threads, again_.stop);
  const PlaceboLimit limit = placebo_limit(placebos, 1.0 - o_.criteria.chance);
  const std::vector<Tested> all = examine_all(s, o_.criteria, limit.wald);
  DiagnosisRound record{.candidates = {}, .placebos = limit, .decision = {}};
  for (const Tested& t : all) record.candidates.push_back(t.evidence);

  const bool may_add = static_cast<int>(added_.size()) < o_.max_effects;
  bool accepted = false;
  if (may_add) {
    std::vector<RefitCandidate> ranked = refitted(
        start, s, all, [&](const std::string& id, double of_refits) { say("refit with " + id, done + share * (0.3 + 0.7 * of_refits)); });
    note_refits(ranked, record);
    note_unfinished(ranked, d_);
    reject(ranked);
    accepted = !ranked.empty() && ranked.front().failure.none();
    if (accepted) {
      record.decision = fmt::format("added {}", ranked.front().tested->candidate->id);
      accept(ranked.front(), indistinguishable_from_best(s, all, ranked, o_.criteria));
    }
  }
  if (!accepted) {
    record.decision = may_add ? "nothing passes every criterion" : "as many effects as were allowed";
    report_detection_limits(all);
  }
  d_.rounds.push_back(std::move(record));
  return accepted;
}

// Those that could be it, best first, the failed ones last.
std::vector<RefitCandidate> Search::refitted(const identify::Identification& start, const Screening& s, const std::vector<Tested>& all,
                                             const std::function<void(const std::string&, double)>& progress) const {
  std::vector<RefitCandidate> ranked = select_model(start, model_, s, all, o_.criteria, again_, o_.refit_limit_s, progress);
  if (!ranked.empty() && !among(gusts().id, o_.without)) leave_to_gusts(score_gust(start), ranked, o_.criteria);
  for (RefitCandidate& c : ranked) {
    if (!c.failure.none() || added_.empty()) continue;
    // What laws of a whole model leave varies with the motion: for a first effect a scatter within that is no objection, for a further one
    // it is.
    if (acts_on_body(*c.tested->candidate) && c.heterogeneity.variation > o_.criteria.larger_part) {
      c.failure = {Rejection::varies, {{"variation", "1", c.heterogeneity.variation, o_.criteria.larger_part}}};
      continue;
    }
    for (std::size_t i = 0; i < added_.size(); ++i) {
      const Candidate& before = added_[i];
      if (c.delta_log_likelihood >= d_.added[i].evidence.delta_log_likelihood) continue;  // a remainder is less than the effect
      const double own =
          share_beside_law(start, before, s, *c.tested->candidate, o_.criteria.law_error, o_.block_s, o_.identify.fit.threads, again_.stop);
      if (own >= o_.criteria.larger_part) continue;
      c.failure = {.id = Rejection::law_remainder, .figures = {{"own_share", "1", own, o_.criteria.larger_part}}, .effect = before.id};
      break;
    }
    if (c.failure.none()) break;  // what stands behind the best is not added in this round
  }
  std::stable_partition(ranked.begin(), ranked.end(), [](const RefitCandidate& c) { return c.failure.none(); });
  return ranked;
}

void Search::reject(const std::vector<RefitCandidate>& ranked) {
  for (const RefitCandidate& c : ranked) {
    if (c.failure.none()) continue;
    d_.rejected.push_back(c.tested->evidence);
    d_.rejected.back().ruled_out_by = c.failure;
  }
}

void Search::accept(RefitCandidate& best, std::vector<ClassMember> aliases) {
  const Candidate& candidate = *best.tested->candidate;
  AddedEffect a{.id = candidate.id, .parameters = best.values, .aliases = std::move(aliases), .evidence = best.tested->evidence};
  a.evidence.delta_log_likelihood = best.delta_log_likelihood;
  a.evidence.ruled_out_by = {};
  a.evidence.optimism = best.optimism;
  a.evidence.relative_size = best.relative_size;
  a.evidence.variation = best.heterogeneity.variation;
  a.evidence.scatter = best.heterogeneity.scatter;
  a.shifts = shifts(model_, best.refit.fit);
  if (const host::CatalogueEffect* row = catalogue_.find(a.id); row && !a.aliases.empty()) a.manoeuvre = row->manoeuvre;
  d_.added.push_back(std::move(a));
  added_.push_back(candidate);
  model_ = std::move(best.refit.fit);
}

void Search::report_detection_limits(const std::vector<Tested>& all) {
  for (const Tested& t : all) {
    const double typical = t.evidence.typical;
    if (t.test.degrees > 0 && !(t.evidence.detectable > typical)) continue;
    const host::CatalogueEffect* row = catalogue_.find(t.candidate->id);
    const std::string& unit = t.candidate->parameters.front().unit;
    d_.not_observable.push_back({t.candidate->id,
                                 t.test.degrees == 0
                                     ? "the model's own parameters take all of it"
                                     : fmt::format("detection limit {:.2g} {}, {:.2g} matters", t.evidence.detectable, unit, typical),
                                 row ? needs_of(*row) : std::string(), t.evidence.detectable, typical, unit});
  }
}

// What the data say of an effect of the fit beside all else, as a Δ log-likelihood.
double worth(const identify::Identification& r, const Candidate& c) {
  const std::vector<int> parameters = parameters_of(c, r.problem.start.terms);
  std::vector<Eigen::Index> at;
  std::vector<double> size;
  for (std::size_t i = 0; i < r.fit.estimates.size(); ++i) {
    const auto k =
        static_cast<std::size_t>(std::find(parameters.begin(), parameters.end(), r.fit.estimates[i].parameter) - parameters.begin());
    if (k == parameters.size()) continue;
    at.push_back(static_cast<Eigen::Index>(i));
    size.push_back(r.fit.estimates[i].value - c.parameters[k].neutral);
  }
  const LltFactor factor(r.fit.covariance(at, at));
  const Eigen::Map<const Eigen::VectorXd> change(size.data(), static_cast<Eigen::Index>(size.size()));
  return factor.succeeded() ? 0.5 * change.dot(factor.inverse() * change) : std::numeric_limits<double>::infinity();
}

// An effect that stood in for others found later: beside them it is worth next to nothing of what it was worth alone, or it is worth less
// than one of them and may be the remainder of its law. `own`: what it is worth.
bool Search::stood_for_another(std::size_t i, double own) const {
  if (i + 1 < added_.size() && own < o_.criteria.negligible * d_.added[i].evidence.delta_log_likelihood) return true;
  for (std::size_t j = i + 1; j < added_.size(); ++j) {
    if (own < worth(model_, added_[j]) && share_beside_law(model_, added_[j], added_[i], o_.criteria.law_error, o_.block_s,
                                                           o_.identify.fit.threads, again_.stop) < o_.criteria.larger_part)
      return true;
  }
  return false;
}

// Backward: what the effects found later made needless goes again. Slopes say so of any size that shares a scale with parameters of the
// model (J_r with I_zz and c_q): all of them may shrink together, but not to nothing. So what the refit without it loses has the last word,
// and counts deflated as the blocks scatter.
void Search::drop_the_needless(const Say& say) {
  for (std::size_t i = added_.size(); i-- > 0 && added_.size() > 1;) {
    const WaldTest test = wald_test(model_, added_[i], o_.criteria.fewest_u);
    if (test.p <= test.sure && !stood_for_another(i, worth(model_, added_[i]))) continue;
    say("refit without " + added_[i].id, 0.93);
    identify::Identification without = refit_without(model_, added_[i], again_);
    again_.stop.check();
    const double loss = model_.fit.log_likelihood - without.fit.log_likelihood;
    const double degrees = std::max(1, test.degrees),
                 p = f_tail(std::max(0.0, 2.0 * loss / (degrees * test.inflation)), degrees, std::max(4.0, test.blocks));
    if (loss >= o_.criteria.negligible * d_.added[i].evidence.delta_log_likelihood && p <= test.sure && !stood_for_another(i, loss))
      continue;
    model_ = std::move(without);
    CandidateEvidence e = d_.added[i].evidence;
    e.ruled_out_by = {Rejection::needless};
    d_.rejected.push_back(std::move(e));
    d_.added.erase(d_.added.begin() + static_cast<std::ptrdiff_t>(i));
    added_.erase(added_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void Search::report_sizes() {
  for (std::size_t i = 0; i < added_.size(); ++i) {
    d_.added[i].parameters = values_in(model_, added_[i]);
    const std::string_view common = host::common_part(added_[i].id);
    if (!common.empty() && !identify::common_part_known(added_[i].id, model_.problem.priors)) {
      d_.remarks.push_back(
          fmt::format("{}: the numbers are differences between rotors; what all have in common is in {}.", added_[i].id, common));
      continue;
    }
    if (added_[i].id == host::SlungLoad::kId) {
      const double body_kg = model_.problem.start[estimate::kMass], load_kg = d_.added[i].parameters.front().value,
                   share = body_kg / (body_kg + load_kg);
      d_.remarks.push_back(
          fmt::format("slung_load: {:.3g} g beside the mass of the vehicle file. If {:.4g} g was weighed with the load, the load is {:.3g} "
                      "g, and all forces, torques and inertias are "
                      "{:.4g} times those here: flights alone do not determine which.",
                      1e3 * load_kg, 1e3 * body_kg, 1e3 * share * load_kg, share));
    }
    for (const int p : parameters_of(added_[i], model_.problem.start.terms)) {
      const std::vector<NamedValue> ratios = firm_ratios(model_.fit, p, model_.problem.start.terms);
      d_.added[i].ratios.insert(d_.added[i].ratios.end(), ratios.begin(), ratios.end());
    }
  }
}

// Where the user held the delay it was a candidate like any other.
void Search::report_pose_time_offset() {
  const bool was_candidate =
      std::any_of(added_.begin(), added_.end(), [](const Candidate& c) { return c.core == std::vector<int>{estimate::kPoseDelay}; });
  if (auto late = pose_time_offset(model_.fit, o_.criteria); late && !was_candidate) d_.added.insert(d_.added.begin(), std::move(*late));
}

// What is not observable in such logs as a rule, unless it was found.
void Search::report_unobservable_in_flight() {
  for (const host::CatalogueEffect& e : catalogue_.effects) {
    const auto is_it = [&](const auto& one) { return one.id == e.id; };
    const bool listed = std::any_of(d_.not_observable.begin(), d_.not_observable.end(), is_it),
               found = std::any_of(d_.added.begin(), d_.added.end(), is_it);
    if (e.observability == "not_observable" && !listed && !found)
      d_.not_observable.push_back({e.id, "does not show in flight logs of this kind", e.needs, 0.0, 0.0, e.parameter.unit});
  }
}

// Effects that change the scatter and not the mean: named when the mean is as the model has it, and when they matter. One that flights
// like these cannot show for certain stays a remark, and so does what is found after the first: it shares its blocks.
void add_scatter(const VarianceResult& variance, const std::vector<std::string>& without, const Criteria& criteria, Diagnosis& d) {
  const host::EffectCatalogue& catalogue = host::builtin_effect_catalogue();
  for (const VarianceEffect& v : variance.effects) {
    const host::CatalogueEffect* row = catalogue.find(v.id);
    if (!v.found || !row || row->observability == "not_observable" || among(v.id, without)) continue;
    const double matters = criteria.relevant * std::fabs(row->parameter.typical_value);
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
    for (const auto& [alias, correlation] : v.aliases) {
      if (catalogue.find(alias)) a.aliases.push_back({alias, correlation, 1.0, {}});
    }
    if (!a.aliases.empty()) a.manoeuvre = row->manoeuvre;
    d.added.push_back(std::move(a));
    return;
  }
}

// What the checks took out of the logs: a fault of a sensor or stream, or no fault. Notes took nothing out.
void report_checks(const FlightsToDiagnose& flights, Diagnosis& d) {
  for (std::size_t f = 0; f < flights.findings.size(); ++f) {
    for (const log::LogFinding& finding : flights.findings[f]) {
      if (finding.action == log::FindingAction::note) continue;
      auto& list = finding.fault ? d.faults : d.left_out;
      list.push_back({flights.fitted[f].record.name, finding.stream, finding.what, finding.from_s, finding.to_s});
    }
  }
  for (const log::CheckedFlight& refused : flights.refused) {
    d.faults.push_back({refused.flight.name, "", refused.refusal->what, 0.0, 0.0});
    d.remarks.push_back(fmt::format("{} is left out: the checks refuse it ({}).", refused.flight.name, refused.refusal->what));
  }
}

// The residual beyond noise, squared over what matters, summed over the axes of force and torque.
double missing_power(const ResidualFindings& left, const estimate::ModelValues& vehicle, const Criteria& criteria) {
  const double weight_N = vehicle[estimate::kMass] * kGravity_m_s2, arm_m = host::arm_m(vehicle.geometry);
  double sum = 0.0;
  for (std::size_t a = 0; a < kAxes; ++a) {
    const AxisUnexplained& axis = left.unexplained.axis[a];
    const double matters = a < 3 ? criteria.force_matters * weight_N : criteria.torque_matters * weight_N * arm_m;
    sum += std::max(0.0, axis.rms * axis.rms - axis.rms_expected * axis.rms_expected) / (matters * matters);
  }
  return sum;
}

}  // namespace

void judge_explained(const ResidualFindings& before, const ResidualFindings& left, const estimate::ModelValues& vehicle, Diagnosis& d,
                     const Criteria& criteria) {
  if (d.added.empty() || d.remains.empty()) return;
  const double was = missing_power(before, vehicle, criteria), is = missing_power(left, vehicle, criteria),
               explained = was > 0.0 ? 1.0 - is / was : 0.0;
  if (explained >= criteria.larger_part) return;
  d.verdict = DiagnosisVerdict::unexplained;
  d.remarks.insert(d.remarks.begin(), fmt::format("What was found explains {:.0f} % of the power of the force and torque that the model "
                                                  "lacks: no explanation, though it lowers the error.",
                                                  100.0 * std::max(0.0, explained)));
}

void judge_residuals(const ResidualFindings& left, const estimate::ModelValues& vehicle, Diagnosis& d,
                     const std::vector<std::string>& without, const Criteria& criteria) {
  const double weight_N = vehicle[estimate::kMass] * kGravity_m_s2, arm_m = host::arm_m(vehicle.geometry);
  for (std::size_t a = 0; a < kAxes; ++a) {
    const AxisUnexplained& axis = left.unexplained.axis[a];
    const double beyond = std::sqrt(std::max(0.0, axis.rms * axis.rms - axis.rms_expected * axis.rms_expected));
    const double matters = a < 3 ? criteria.force_matters * weight_N : criteria.torque_matters * weight_N * arm_m;
    const bool bursts = left.unexplained.kind[a] == ResidualKind::bursts;
    const bool systematic = left.unexplained.kind[a] == ResidualKind::systematic;
    if (beyond > matters && (bursts || systematic)) {
      d.remains.push_back({std::string(kAxisNames[a]), std::string(kAxisUnits[a]), bursts,
                           bursts ? axis.burst_share : axis.explainable.share, beyond, matters});
    }
  }
  if (d.added.empty()) {
    add_scatter(left.variance, without, criteria, d);
    if (!d.added.empty()) {
      d.verdict = DiagnosisVerdict::named;
      std::erase_if(d.remains, [](const RemainingResidual& r) { return r.bursts; });  // what gusts do
    } else if (!d.remains.empty()) {
      d.verdict = DiagnosisVerdict::unexplained;
    }
  }
  d.remarks.insert(d.remarks.end(), left.words.begin(), left.words.end());
}

namespace {

// What the search found, as far as it came.
void report_model(Search& search, const host::VehicleFile& vehicle, const DiagnoseOptions& o, DiagnosisRun& out) {
  Diagnosis& d = out.diagnosis;
  search.report_sizes();
  search.report_pose_time_offset();
  search.report_unobservable_in_flight();
  out.after = std::move(search).model();
  d.remarks.push_back(measurements_used(out.after));
  if (!d.rounds.empty()) note_placebos(o.criteria, d);
  if (out.after.fit.converged) note_contradictions(out.after, d);
  d.white = innovations_white(out.after);
  const bool ambiguous = std::any_of(d.added.begin(), d.added.end(), [](const AddedEffect& a) { return !a.aliases.empty(); });
  d.verdict = ambiguous ? DiagnosisVerdict::ambiguous : d.added.empty() ? DiagnosisVerdict::clean : DiagnosisVerdict::named;
  if (!vehicle.ceiling_z_m)
    d.not_observable.push_back({std::string(host::CeilingEffect::kId), "the vehicle file names no ceiling",
                                "[room] ceiling_z_m in the vehicle file, m", 0.0, 0.0, "1"});
}

// What is left of the flights, and flights held out.
void judge_what_is_left(const FlightsToDiagnose& flights, const DiagnoseOptions& o, const Search::Say& say, DiagnosisRun& out) {
  const estimate::StopFit stop = o.identify.fit.stop;
  Diagnosis& d = out.diagnosis;
  stop.check();
  if (out.after.problem.flights.front()->pose.empty()) {
    d.remarks.push_back("flights without poses: residuals are not looked at by themselves");
  } else {
    say("analysis of the residuals", 0.95);
    out.residuals = analyse_residuals(out.after, {.seed = o.seed, .logs = flights.fitted, .criteria = o.criteria});
    judge_residuals(*out.residuals, out.after.problem.start, d, o.without, o.criteria);
    if (!d.added.empty() && !d.remains.empty()) {
      const ResidualFindings before = analyse_residuals(out.before, {.seed = o.seed, .logs = flights.fitted, .criteria = o.criteria});
      judge_explained(before, *out.residuals, out.after.problem.start, d, o.criteria);
    }
  }
  stop.check();
  if (!flights.held_out.empty()) {
    say("score of the held-out flights", 0.97);
    out.held_out = identify::score_models(flights.held_out, out.before, out.after, o.identify.grid, o.wrench_band);
  }
}

}  // namespace

DiagnosisRun diagnose(const FlightsToDiagnose& flights, const host::VehicleFile& vehicle, const DiagnoseOptions& o,
                      const std::function<void(const DiagnoseProgress&)>& progress) {
  std::string part;
  const Search::Say say = [&](const std::string& next, double done) {
    part = next;
    if (progress) progress({next, done});
  };
  DiagnosisRun out;
  Diagnosis& d = out.diagnosis;

  say("fit of the nominal model", 0.0);
  identify::IdentifyOptions first = o.identify;
  if (o.priors) first.priors = vehicle_priors;
  first.fit.innovations = true;
  out.before = identify::identify(flights.fitted, vehicle, first);

  Search search(o, first.fit, out.before, d);
  bool stopped = false;
  try {
    for (int round = 0; search.add_the_best(round, say);) ++round;
    search.drop_the_needless(say);
  } catch (const estimate::FitStopped&) {
    stopped = true;
  }
  report_model(search, vehicle, o, out);
  report_checks(flights, d);
  try {
    if (!stopped) {
      choose_manoeuvres(out, o.library, o.identify.fit.threads, o.identify.fit.stop);
      judge_what_is_left(flights, o, say, out);
    }
  } catch (const estimate::FitStopped&) {
    stopped = true;
  }
  if (stopped) {
    d.verdict = DiagnosisVerdict::incomplete;
    d.remarks.insert(d.remarks.begin(), "stopped during: " + part + "; what stands here was found before");
  } else {
    say("done", 1.0);
  }
  return out;
}

}  // namespace rotorloop::diagnose
