// Why an effect is not the missing one, as data. report/rejection_text.hpp says it in English.
#pragma once
#include <array>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop::diagnose {

enum class Rejection {
  none,                   // nothing speaks against it
  absorbed,               // the model's own parameters take all of it
  chance,                 // p after Holm
  placebos,               // W, below that of nearly all placebos
  out_of_range,           // one step leaves its physical range
  too_small,              // size over the size that matters
  costs_more,             // gain of log likelihood; number of its parameters
  not_cross_validated,    // gain on blocks that did not estimate it; gain
  lesser_cause,           // W that `effect`, itself too small to matter, leaves of it
  refit_failed,           // `detail` says why
  not_converged,          // the refit
  out_of_iterations,      // the refit; how many it may take
  at_bound,               // of its physical range, after the refit
  low_likelihood_gain,    // of the log likelihood by the refit
  chance_after_refit,     // standard errors; or W, p and the number of its parameters
  law_not_found,          // standard errors of the number that makes it this law (`detail` names it), and how many are asked for
  too_small_after_refit,  // size over the size that matters
  varies,                 // its size between stretches of the flights, over that size
  far_behind,             // share of what `effect` explains, with prior values held
  predicts_less,          // Δ log-likelihood on blocks that did not estimate it; that of `effect`, a law of fewer numbers within it
  law_remainder,          // share of its information that is left beside variations of the law of `effect`
  mean_of_gusts,          // wind, m/s; standard deviation and correlation time of gusts
  gusts,                  // Δ log-likelihood; standard deviation and correlation time of gusts; their gain
  not_refitted,           // others that explain more were, and failed
  needless,               // beside what was found after it
};
std::string_view name(Rejection r);  // as in result.json: the word above

// A figure that decided, beside what it was compared with.
struct RejectionFigure {
  std::string_view name, unit;
  double value = 0.0;
  double limit = std::numeric_limits<double>::quiet_NaN();  // none: context
};

struct Reason {
  Rejection id = Rejection::none;
  std::vector<RejectionFigure> figures = {};
  std::string effect = {};  // that stands in its way
  std::string detail = {};  // of refit_failed: why; of law_not_found: the number
  std::string as = {};      // the effect that was refitted in its stead, as their columns are the same
  bool none() const { return id == Rejection::none; }
};

}  // namespace rotorloop::diagnose
