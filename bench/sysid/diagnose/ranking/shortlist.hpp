// Which candidates of the screening are refitted: a refit costs a fit, so the best few of each order of merit.
#pragma once
#include <vector>

#include "bench/sysid/diagnose/examine.hpp"
#include "bench/sysid/diagnose/ranking/refit.hpp"

namespace rotorloop::diagnose {

struct RefitCandidate {
  const Tested* tested = nullptr;
  Refit refit = {};                      // with the effect
  std::vector<NamedValue> values = {};   // of its parameters there
  double delta_log_likelihood = 0.0;     // by the refit
  double score = 0.0;                    // delta_log_likelihood less what its parameters cost
  double optimism = 0.0;                 // of the refit, beyond the model without the effect
  double relative_size = 0.0;            // over what matters
  Heterogeneity heterogeneity = {};      // of its size over the flights
  Reason failure = {};                   // why it cannot be the missing effect; none: it could
  std::vector<const Tested*> same = {};  // others whose columns are those of this one
  int iterations = 0;                    // that its refit has taken
};

// The log likelihood that its parameters cost: half of Schwarz's criterion (BIC).
double parameter_cost(const Tested& tested, double measurements);

// Whose refit is worth its time; each with those that say the same. `all`: as examine_all() has them.
std::vector<RefitCandidate> shortlist(const Screening& screening, const std::vector<Tested>& all, const Criteria& criteria);

}  // namespace rotorloop::diagnose
