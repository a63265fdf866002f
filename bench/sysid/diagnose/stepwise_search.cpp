#include "bench/sysid/diagnose/stepwise_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/sysid/diagnose/law_remainder.hpp"
#include "bench/sysid/diagnose/placebos.hpp"
#include "bench/sysid/diagnose/pose_time_offset.hpp"
#include "bench/sysid/diagnose/ranking/gust.hpp"
#include "bench/sysid/diagnose/ratios.hpp"
#include "bench/sysid/diagnose/remarks.hpp"
#include "bench/sysid/diagnose/wald.hpp"
#include "bench/sysid/identify/gauge.hpp"
#include "bench/sysid/identify/identified_vehicle.hpp"
#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"
#include "host/effects/rotor_groups.hpp"

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
      e.refit_iterations = c->iterations;
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

// What it takes to see an effect: what is needed beside such logs, and the flight.
std::string needs_of(const host::CatalogueEffect& e) {
  return e.needs + (e.needs.empty() || e.manoeuvre.empty() ? "" : "; ") + e.manoeuvre;
}

// What the data say of an effect of the fit beside all else, as a Δ log-likelihood.
double wald_gain(const identify::Identification& r, const Candidate& c) {
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

}  // namespace

bool StepwiseSearch::forward_step(int round, const Say& say) {
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
std::vector<RefitCandidate> StepwiseSearch::refitted(const identify::Identification& start, const Screening& s,
                                                     const std::vector<Tested>& all,
                                                     const std::function<void(const std::string&, double)>& progress) const {
  std::vector<RefitCandidate> ranked = rank_by_refits(start, model_, s, all, o_.criteria, again_, o_.refit_iterations, progress);
  if (!ranked.empty() && !among(gusts().id, o_.without)) reject_explained_by_gusts(score_gust(start), ranked, o_.criteria);
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

void StepwiseSearch::reject(const std::vector<RefitCandidate>& ranked) {
  for (const RefitCandidate& c : ranked) {
    if (c.failure.none()) continue;
    d_.rejected.push_back(c.tested->evidence);
    d_.rejected.back().ruled_out_by = c.failure;
    d_.rejected.back().refit_iterations = c.iterations;
  }
}

void StepwiseSearch::accept(RefitCandidate& best, std::vector<ClassMember> aliases) {
  const Candidate& candidate = *best.tested->candidate;
  AddedEffect a{.id = candidate.id, .parameters = best.values, .aliases = std::move(aliases), .evidence = best.tested->evidence};
  a.evidence.delta_log_likelihood = best.delta_log_likelihood;
  a.evidence.refit_iterations = best.iterations;
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

void StepwiseSearch::report_detection_limits(const std::vector<Tested>& all) {
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

// An effect that stood in for others found later: beside them it is worth next to nothing of what it was worth alone, or it is worth less
// than one of them and may be the remainder of its law. `own`: what it is worth.
bool StepwiseSearch::superseded(std::size_t i, double own) const {
  if (i + 1 < added_.size() && own < o_.criteria.negligible * d_.added[i].evidence.delta_log_likelihood) return true;
  for (std::size_t j = i + 1; j < added_.size(); ++j) {
    if (own < wald_gain(model_, added_[j]) && share_beside_law(model_, added_[j], added_[i], o_.criteria.law_error, o_.block_s,
                                                               o_.identify.fit.threads, again_.stop) < o_.criteria.larger_part)
      return true;
  }
  return false;
}

// Backward: what the effects found later made needless goes again. Slopes say so of any size that shares a scale with parameters of the
// model (J_r with I_zz and c_q): all of them may shrink together, but not to nothing. So what the refit without it loses has the last word,
// and counts deflated as the blocks scatter.
void StepwiseSearch::backward_elimination(const Say& say) {
  for (std::size_t i = added_.size(); i-- > 0 && added_.size() > 1;) {
    const WaldTest test = wald_test(model_, added_[i], o_.criteria.fewest_u);
    if (test.p <= test.sure && !superseded(i, wald_gain(model_, added_[i]))) continue;
    say("refit without " + added_[i].id, 0.93);
    identify::Identification without = refit_without(model_, added_[i], again_);
    again_.stop.check();
    const double loss = model_.fit.log_likelihood - without.fit.log_likelihood;
    const double degrees = std::max(1, test.degrees),
                 p = f_tail(std::max(0.0, 2.0 * loss / (degrees * test.inflation)), degrees, std::max(4.0, test.blocks));
    if (loss >= o_.criteria.negligible * d_.added[i].evidence.delta_log_likelihood && p <= test.sure && !superseded(i, loss)) continue;
    model_ = std::move(without);
    CandidateEvidence e = d_.added[i].evidence;
    e.ruled_out_by = {Rejection::needless};
    d_.rejected.push_back(std::move(e));
    d_.added.erase(d_.added.begin() + static_cast<std::ptrdiff_t>(i));
    added_.erase(added_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void StepwiseSearch::report_sizes() {
  for (std::size_t i = 0; i < added_.size(); ++i) {
    d_.added[i].parameters = values_in(model_, added_[i]);
    const std::string_view common = host::common_part(added_[i].id);
    if (!common.empty() && !identify::common_part_known(added_[i].id, model_.problem.priors)) {
      d_.remarks.push_back(
          fmt::format("{}: the numbers are differences between rotors; what all have in common is in {}.", added_[i].id, common));
      continue;
    }
    if (const host::Term* term = added_[i].term; term && term->info.traits.mass_beside_body)
      d_.remarks.push_back(mass_beside_body(added_[i].id, d_.added[i].parameters.front().value, model_.problem.start[estimate::kMass]));
    for (const int p : parameters_of(added_[i], model_.problem.start.terms)) {
      const std::vector<NamedValue> ratios = well_determined_ratios(model_.fit, p, model_.problem.start.terms);
      d_.added[i].ratios.insert(d_.added[i].ratios.end(), ratios.begin(), ratios.end());
    }
  }
}

// Where the user held the delay it was a candidate like any other.
void StepwiseSearch::report_pose_time_offset() {
  const bool was_candidate =
      std::any_of(added_.begin(), added_.end(), [](const Candidate& c) { return c.core == std::vector<int>{estimate::kPoseDelay}; });
  if (auto late = pose_time_offset(model_.fit, o_.criteria); late && !was_candidate) d_.added.insert(d_.added.begin(), std::move(*late));
}

// What is not observable in such logs as a rule, unless it was found.
void StepwiseSearch::report_unobservable_in_flight() {
  for (const host::CatalogueEffect& e : catalogue_.effects) {
    const auto is_it = [&](const auto& one) { return one.id == e.id; };
    const bool listed = std::any_of(d_.not_observable.begin(), d_.not_observable.end(), is_it),
               found = std::any_of(d_.added.begin(), d_.added.end(), is_it);
    if (e.observability == "not_observable" && !listed && !found)
      d_.not_observable.push_back({e.id, "does not show in flight logs of this kind", e.needs, 0.0, 0.0, e.parameter.unit});
  }
}

}  // namespace rotorloop::diagnose
