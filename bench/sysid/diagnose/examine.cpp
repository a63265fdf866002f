#include "bench/sysid/diagnose/examine.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/statistics.hpp"

namespace rotorloop::diagnose {
using Index = ScoreTable::Index;

double relevance(const Candidate& c, const Eigen::VectorXd& change) {
  double out = 0.0;
  for (std::size_t k = 0; k < c.parameters.size(); ++k)
    out = std::max(out, std::fabs(change[static_cast<Index>(k)]) / c.parameters[k].scale);
  return out;
}

namespace {

double deflated_bic(const GroupTest& t, double measurements) {
  return t.gain - 0.5 * t.degrees * std::log(measurements / std::max(1.0, t.inflation));
}

// Inside the physical range within its uncertainty, and within what one step may overshoot by where the effect is not linear.
bool inside(const Candidate& c, const GroupTest& t, const Criteria& criteria) {
  for (std::size_t k = 0; k < c.parameters.size(); ++k) {
    const auto i = static_cast<Index>(k);
    const CandidateParameter& q = c.parameters[k];
    const double value = q.neutral + t.estimate[i], slack = criteria.fewest_u * std::sqrt(std::max(0.0, t.covariance(i, i)));
    const double below = slack + criteria.law_error * (q.neutral - q.min), above = slack + criteria.law_error * (q.max - q.neutral);
    if (value < q.min - below || value > q.max + above) return false;
  }
  return true;
}

Tested examine(const ScoreTable& table, const ColumnSet& model, const Candidate& c, const Criteria& criteria) {
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
  e.gain_relative = 2.0 * t.gain / table.measurements;
  e.bic = deflated_bic(t, table.measurements);
  e.inside_bounds = inside(c, t, criteria);
  e.relative_size = relevance(c, t.estimate);
  if (t.degrees > 0) e.cross_validated = cross_validated_gain(table, model, c.columns, t.inflation);
  e.typical = c.parameters.front().scale;
  e.detectable = t.degrees > 0 ? criteria.fewest_u * e.one_step.front().u : 0.0;
  return out;
}

Reason first_failure(const Tested& t, const Criteria& criteria, double placebo) {
  const CandidateEvidence& e = t.evidence;
  if (e.degrees == 0) return {Rejection::absorbed};
  if (e.p_holm > criteria.chance) return {Rejection::chance, {{"p_holm", "1", e.p_holm, criteria.chance}}};
  if (e.wald < placebo) return {Rejection::placebos, {{"wald", "1", e.wald, placebo}}};
  if (!e.inside_bounds) return {Rejection::out_of_range};
  if (const double size = relevance(*t.candidate, t.test.estimate); size < criteria.relevant)
    return {Rejection::too_small, {{"relative_size", "1", size, criteria.relevant}}};
  if (e.bic <= 0.0) return {Rejection::costs_more, {{"gain", "1", e.gain}, {"parameters", "1", static_cast<double>(e.degrees)}}};
  if (e.cross_validated < criteria.negligible * e.gain)
    return {Rejection::not_cross_validated,
            {{"cross_validated", "1", e.cross_validated, criteria.negligible * e.gain}, {"gain", "1", e.gain}}};
  return {};
}

// Where a single number better attested, but too small to matter, leaves nothing of a candidate with several: the prior is off by
// a little there, and no effect is missing.
Reason lesser_cause(const ScoreTable& table, const ColumnSet& model, const Tested& t, const std::vector<Tested>& all,
                    const Criteria& criteria, double placebo) {
  for (const Tested& m : all) {
    if (!m.minor || m.test.degrees >= t.test.degrees || m.test.wald <= t.test.wald) continue;
    const GroupTest beside = test_group(table, with(model, m.candidate->columns), t.candidate->columns);
    if (beside.wald < placebo || beside.p > criteria.chance)
      return {.id = Rejection::lesser_cause, .figures = {{"wald", "1", beside.wald, placebo}}, .effect = m.candidate->id};
  }
  return {};
}

}  // namespace

std::vector<Tested> examine_all(const Screening& s, const Criteria& criteria, double placebo) {
  std::vector<Tested> all;
  const ColumnSet model = base_columns(s.table);
  for (const Candidate& c : s.candidates) all.push_back(examine(s.table, model, c, criteria));
  std::vector<double> p;
  for (const Tested& t : all) p.push_back(t.evidence.p);
  const std::vector<double> adjusted = holm(p);
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].evidence.p_holm = adjusted[i];
    all[i].evidence.ruled_out_by = first_failure(all[i], criteria, placebo);
    all[i].real = all[i].evidence.ruled_out_by.none();
    Criteria of_any_size = criteria;
    of_any_size.relevant = 0.0;
    all[i].minor = !all[i].real && first_failure(all[i], of_any_size, placebo).none();
  }
  for (Tested& t : all) {
    if (t.real) t.evidence.ruled_out_by = lesser_cause(s.table, model, t, all, criteria, placebo);
    t.real = t.evidence.ruled_out_by.none();
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Tested& a, const Tested& b) { return a.real != b.real ? a.real : a.evidence.bic > b.evidence.bic; });
  return all;
}

}  // namespace rotorloop::diagnose
