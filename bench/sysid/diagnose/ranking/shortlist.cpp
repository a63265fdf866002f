#include "bench/sysid/diagnose/ranking/shortlist.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::diagnose {

double parameter_cost(const Tested& t, double measurements) { return 0.5 * t.test.degrees * std::log(measurements); }

std::vector<RefitCandidate> shortlist(const Screening& s, const std::vector<Tested>& all, const Criteria& criteria) {
  std::vector<const Tested*> by_scatter, by_likelihood;
  for (const Tested& t : all) {
    if (t.real) by_scatter.push_back(&t);
  }
  by_likelihood = by_scatter;
  const auto likelihood = [&](const Tested* t) { return 0.5 * t->test.chi2 - parameter_cost(*t, s.table.measurements); };
  std::stable_sort(by_likelihood.begin(), by_likelihood.end(),
                   [&](const Tested* a, const Tested* b) { return likelihood(a) > likelihood(b); });
  std::vector<RefitCandidate> out;
  const ColumnSet model = base_columns(s.table);
  const auto take = [&](const std::vector<const Tested*>& order, std::size_t most) {
    std::size_t taken = 0;
    for (const Tested* t : order) {
      if (taken == most) break;
      bool known = false;
      for (RefitCandidate& c : out) {
        const auto& other = c.tested->candidate->columns;
        if (c.tested == t || std::find(c.same.begin(), c.same.end(), t) != c.same.end()) {
          known = true;
        } else if (other.size() == t->candidate->columns.size() &&
                   confounding(s.table, model, other, t->candidate->columns) > criteria.alike) {
          c.same.push_back(t);
          known = true;
        }
        if (known) break;
      }
      ++taken;
      if (!known) out.push_back({.tested = t});
    }
  };
  take(by_likelihood, criteria.refits);
  take(by_scatter, criteria.refits);
  // Where the model lacks much, its blocks scatter by just that, and one step is short: what the lack is may fail every test of scatter
  // that a small part of it passes. What explains more than anything that passes is refitted too.
  if (by_likelihood.empty()) return out;
  double best = 0.0;
  for (const Tested* t : by_scatter) best = std::max(best, t->test.chi2);
  std::vector<const Tested*> strongest;
  for (const Tested& t : all) {
    if (!t.real && t.test.degrees > 0 && t.test.chi2 > best && relevance(*t.candidate, t.test.estimate) > criteria.relevant)
      strongest.push_back(&t);
  }
  std::stable_sort(strongest.begin(), strongest.end(), [&](const Tested* a, const Tested* b) { return likelihood(a) > likelihood(b); });
  take(strongest, criteria.refits);
  return out;
}

}  // namespace rotorloop::diagnose
