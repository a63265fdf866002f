#include "bench/sysid/diagnose/ranking/refit_ranking.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/sysid/diagnose/wald.hpp"
#include "bench/sysid/identify/identified_vehicle.hpp"

namespace rotorloop::diagnose {
namespace {

// An effect that is absent altogether (a share of 0 where 1 is neutral) stands at a bound and is right there.
bool at_bound(const Candidate& c, const std::vector<NamedValue>& values) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    const CandidateParameter& q = c.parameters[k];
    const double slack = 1e-6 * (q.max - q.min);
    const bool low = values[k].value <= q.min + slack && q.min != q.neutral && q.min != 0.0;
    const bool high = values[k].value >= q.max - slack && q.max != q.neutral;
    if (low || high) return true;
  }
  return false;
}

Eigen::VectorXd change(const Candidate& c, const std::vector<NamedValue>& values) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(values.size()));
  for (std::size_t k = 0; k < values.size(); ++k) out[static_cast<Eigen::Index>(k)] = values[k].value - c.parameters[k].neutral;
  return out;
}

// A number that the fit leaves where it changes nothing costs nothing: a law of several numbers is as simple as what it comes to.
double cost_after_refit(const RefitCandidate& c, double measurements, const Criteria& criteria) {
  int moved = 0;
  for (std::size_t k = 0; k < c.values.size(); ++k)
    moved += std::fabs(c.values[k].value - c.tested->candidate->parameters[k].neutral) > criteria.fewest_u * c.values[k].u;
  return 0.5 * std::clamp(moved, 1, std::max(1, c.tested->test.degrees)) * std::log(measurements);
}

double standard_errors(const NamedValue& v, double neutral) {
  return v.u > 0.0 ? std::fabs(v.value - neutral) / v.u : std::numeric_limits<double>::infinity();
}

Heterogeneity heterogeneity_of(const identify::Identification& refit, const Candidate& c) {
  const std::vector<int> parameters = parameters_of(c, refit.problem.start.terms);
  ColumnSet own, others;
  Eigen::VectorXd size(static_cast<Eigen::Index>(parameters.size()));
  const auto& estimates = refit.fit.estimates;
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    const auto found = std::find(parameters.begin(), parameters.end(), estimates[i].parameter);
    (found == parameters.end() ? others : own).push_back(static_cast<Eigen::Index>(i));
    if (found == parameters.end()) continue;
    const auto k = static_cast<std::size_t>(found - parameters.begin());
    size[static_cast<Eigen::Index>(own.size()) - 1] = estimates[i].value - c.parameters[k].neutral;
  }
  return heterogeneity(table_of(refit), others, own, size);
}

double optimism_of(const identify::Identification& fit) {
  const ScoreTable table = table_of(fit);
  return optimism(table, base_columns(table));
}

// What the refit says of an effect, and why it cannot be what is missing, if so.
void judge(RefitCandidate& c, const identify::Identification& model, const Screening& s, const Criteria& criteria) {
  const Candidate& candidate = *c.tested->candidate;
  const estimate::Fit& fit = c.refit.fit.fit;
  c.values = values_in(c.refit.fit, candidate);
  c.delta_log_likelihood = fit.log_likelihood - model.fit.log_likelihood;
  c.score = c.delta_log_likelihood - cost_after_refit(c, s.table.measurements, criteria);
  c.relative_size = relevance(candidate, change(candidate, c.values));
  const WaldTest all = wald_test(c.refit.fit, candidate, criteria.fewest_u);
  c.heterogeneity = heterogeneity_of(c.refit.fit, candidate);
  const NamedValue* own = defining_number(candidate, c.values);
  const double found =
      own ? standard_errors(*own, candidate.parameters[static_cast<std::size_t>(own - c.values.data())].neutral) : criteria.fewest_u;
  if (!fit.converged) {
    c.failure = {Rejection::not_converged};
  } else if (at_bound(candidate, c.values)) {
    c.failure = {Rejection::at_bound};
  } else if (c.score <= 0.0) {
    c.failure = {Rejection::low_likelihood_gain, {{"delta_log_likelihood", "1", c.delta_log_likelihood, c.delta_log_likelihood - c.score}}};
  } else if (all.p > all.sure) {
    c.failure = {Rejection::chance_after_refit};
    if (all.degrees == 1) {
      c.failure.figures = {{"standard_errors", "1", std::sqrt(all.statistic), criteria.fewest_u}};
    } else {
      c.failure.figures = {
          {"wald", "1", all.statistic}, {"parameters", "1", static_cast<double>(all.degrees)}, {"p", "1", all.p, all.sure}};
    }
  } else if (found < criteria.fewest_u) {
    c.failure = {.id = Rejection::law_not_found, .figures = {{"standard_errors", "1", found, criteria.fewest_u}}, .detail = own->name};
  } else if (c.relative_size < criteria.relevant) {
    c.failure = {Rejection::too_small_after_refit, {{"relative_size", "1", c.relative_size, criteria.relevant}}};
  } else if (acts_on_body(candidate) && c.heterogeneity.variation > criteria.larger_part && c.heterogeneity.scatter > criteria.scatter) {
    c.failure = {Rejection::varies, {{"variation", "1", c.heterogeneity.variation, criteria.larger_part}}};
  }
}

// Whether every direction of a law of fewer numbers is one of a richer law's.
bool holds(const Screening& s, const RefitCandidate& richer, const RefitCandidate& simpler, const Criteria& criteria) {
  const ColumnSet &all = richer.tested->candidate->columns, &some = simpler.tested->candidate->columns;
  if (some.size() >= all.size()) return false;
  const Eigen::VectorXd shared = canonical_correlations(s.table, base_columns(s.table), all, some);
  return shared.size() == static_cast<Eigen::Index>(some.size()) && shared.minCoeff() > criteria.alike;
}

}  // namespace

const NamedValue* defining_number(const Candidate& c, const std::vector<NamedValue>& values) {
  const host::CatalogueEffect* row = host::builtin_effect_catalogue().find(c.id);
  if (!row || values.size() < 2) return nullptr;
  const auto it = std::find_if(values.begin(), values.end(), [&](const NamedValue& v) { return v.name == row->parameter.name; });
  if (it == values.end() || std::count_if(values.begin(), values.end(), [&](const NamedValue& v) { return v.unit == it->unit; }) > 1)
    return nullptr;
  return &*it;
}

void prefer_the_simpler(std::vector<RefitCandidate>& ranked, const Screening& s, const Criteria& criteria) {
  const auto predicted = [](const RefitCandidate& c) { return c.tested->evidence.cross_validated; };
  for (RefitCandidate& richer : ranked) {
    const auto better = std::find_if(ranked.begin(), ranked.end(), [&](const RefitCandidate& c) {
      return c.failure.none() && richer.score - c.score >= criteria.class_margin && predicted(c) > predicted(richer) &&
             holds(s, richer, c, criteria);
    });
    if (!richer.failure.none() || better == ranked.end()) continue;
    richer.failure = {.id = Rejection::predicts_less,
                      .figures = {{"cross_validated", "1", predicted(richer), predicted(*better)}},
                      .effect = better->tested->candidate->id};
  }
  std::stable_partition(ranked.begin(), ranked.end(), [](const RefitCandidate& c) { return c.failure.none(); });
  auto first = ranked.begin();
  for (auto c = ranked.begin(); c != ranked.end() && c->failure.none(); ++c) {
    if (ranked.front().score - c->score < criteria.class_margin && c->values.size() < first->values.size()) first = c;
  }
  if (first != ranked.end()) std::rotate(ranked.begin(), first, std::next(first));
}

std::vector<NamedValue> values_in(const identify::Identification& r, const Candidate& c) {
  std::vector<NamedValue> out;
  const auto parameters = parameters_of(c, r.problem.start.terms);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const estimate::Estimate* e = r.fit.find(parameters[k]);
    out.push_back({c.parameters[k].name, c.parameters[k].unit, e ? e->value : c.parameters[k].neutral, e ? identify::reported_u(*e) : 0.0});
  }
  return out;
}

bool far_behind(const RefitCandidate& c, const RefitCandidate& leader, double without, double freed, const Criteria& criteria) {
  // What moves by itself follows states that still lack it: its cost falls again with every round of the refit.
  if (c.tested && c.tested->candidate->term && !c.tested->candidate->term->info.memory.empty()) return false;
  if (!c.refit.cost_held || !leader.refit.cost_held) return false;
  // What the screening puts above the leader is judged by its own refit: with the priors held its step may have been too long.
  if (c.tested && leader.tested && c.tested->test.chi2 > leader.tested->test.chi2) return false;
  const double explained = without - *c.refit.cost_held, by_leader = without - *leader.refit.cost_held;
  if (by_leader <= 0.0 || by_leader <= criteria.larger_part * (without - freed) || explained >= criteria.larger_part * by_leader)
    return false;
  return leader.delta_log_likelihood * (1.0 - std::max(explained, 0.0) / by_leader) > criteria.class_margin / criteria.negligible;
}

std::vector<RefitCandidate> rank_by_refits(const identify::Identification& start, const identify::Identification& model, const Screening& s,
                                           const std::vector<Tested>& all, const Criteria& criteria, const estimate::FitOptions& options,
                                           int refit_iterations, const std::function<void(const std::string&, double)>& progress) {
  double begun = 0.0;
  const auto say = [&](const RefitCandidate& c, double of) {
    if (progress) progress(c.tested->candidate->id, begun++ / of);
  };
  std::vector<RefitCandidate> ranked = shortlist(s, all, criteria);
  const auto attempt = [&](RefitCandidate& c, auto&& act) {
    int left = refit_iterations - c.iterations;
    estimate::FitOptions limited = options;
    limited.stop.iterations_left = &left;
    try {
      act(limited);
    } catch (const std::exception& e) {
      c.failure = {.id = Rejection::refit_failed, .detail = e.what()};
    }
    c.iterations = refit_iterations - std::max(left, 0);
    if (left < 0) c.failure = {Rejection::out_of_iterations, {{"limit", "1", static_cast<double>(refit_iterations)}}};
    options.stop.check();
  };
  const double refits = 2.0 * static_cast<double>(ranked.size());
  for (RefitCandidate& c : ranked) {
    say(c, refits);
    attempt(c, [&](const estimate::FitOptions& o) {
      c.refit = begin_refit(start, *c.tested->candidate, c.tested->test.estimate, model.fit.noise, o);
    });
  }
  const auto unexplained = [](const RefitCandidate& c) { return c.refit.cost_held.value_or(0.0); };
  std::stable_sort(ranked.begin(), ranked.end(),
                   [&](const RefitCandidate& a, const RefitCandidate& b) { return unexplained(a) < unexplained(b); });
  std::optional<double> without, optimism_without;
  const RefitCandidate* leader = nullptr;
  for (RefitCandidate& c : ranked) {
    if (!c.failure.none()) continue;
    if (leader && !without) without = cost_held(start, model.fit.noise, options);
    if (leader && without && far_behind(c, *leader, *without, model.fit.cost, criteria)) {
      c.failure = {
          .id = Rejection::far_behind,
          .figures = {{"share", "1", (*without - *c.refit.cost_held) / (*without - *leader->refit.cost_held), criteria.larger_part}},
          .effect = leader->tested->candidate->id};
      continue;
    }
    say(c, refits);
    attempt(c, [&](const estimate::FitOptions& o) { finish_refit(c.refit, o); });
    if (!c.failure.none()) continue;
    judge(c, model, s, criteria);
    if (!optimism_without) optimism_without = optimism_of(model);
    c.optimism = optimism_of(c.refit.fit) - *optimism_without;
    if (!leader && c.failure.none()) leader = &c;
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const RefitCandidate& a, const RefitCandidate& b) {
    return a.failure.none() != b.failure.none() ? a.failure.none() : a.score > b.score;
  });
  prefer_the_simpler(ranked, s, criteria);
  return ranked;
}

std::vector<ClassMember> indistinguishable_from_best(const Screening& s, const std::vector<Tested>& all,
                                                     const std::vector<RefitCandidate>& ranked, const Criteria& criteria) {
  std::vector<ClassMember> out;
  const RefitCandidate& best = ranked.front();
  const ColumnSet model = base_columns(s.table);
  const double margin = criteria.class_margin * std::clamp(best.tested->test.inflation, 1.0, 1.0 / criteria.negligible);
  std::vector<const Tested*> known;
  const auto add = [&](const Tested& t, const std::vector<NamedValue>& values, double gain_share) {
    out.push_back(
        {t.candidate->id, confounding(s.table, model, best.tested->candidate->columns, t.candidate->columns), gain_share, values});
  };
  for (const RefitCandidate& c : ranked) {
    if (c.failure.id == Rejection::out_of_iterations) continue;  // is judged by the residuals, as what was not refitted
    known.push_back(c.tested);
    known.insert(known.end(), c.same.begin(), c.same.end());
    if (!c.failure.none() || (&c != &best && best.score - c.score > margin)) continue;
    if (&c != &best) add(*c.tested, c.values, c.delta_log_likelihood / best.delta_log_likelihood);
    for (const Tested* t : c.same)
      if (t->evidence.inside_bounds) add(*t, t->evidence.one_step, c.delta_log_likelihood / best.delta_log_likelihood);
  }
  // What was not worth a refit by itself may still be as good as the best by the residuals, and much the same; or the same in every
  // direction, whatever gate of chance kept it from the field: no flight like these distinguishes it.
  for (const Tested& t : all) {
    if (t.test.degrees == 0 || !t.evidence.inside_bounds || std::find(known.begin(), known.end(), &t) != known.end()) continue;
    if (relevance(*t.candidate, t.test.estimate) < criteria.relevant) continue;
    const double behind = 0.5 * (best.tested->test.chi2 - t.test.chi2) - parameter_cost(*best.tested, s.table.measurements) +
                          parameter_cost(t, s.table.measurements);
    const Eigen::VectorXd shared = canonical_correlations(s.table, model, best.tested->candidate->columns, t.candidate->columns);
    const bool same = t.test.degrees == best.tested->test.degrees && shared.size() > 0 && shared.minCoeff() > criteria.alike;
    if (!same && (behind > margin || shared.size() == 0 || shared[0] < 1.0 - criteria.negligible)) continue;
    add(t, t.evidence.one_step, t.test.chi2 / best.tested->test.chi2);
  }
  return out;
}

}  // namespace rotorloop::diagnose
