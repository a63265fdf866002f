#include "bench/sysid/diagnose/report/rejection_text.hpp"

#include <fmt/format.h>

namespace rotorloop::diagnose {
namespace {

std::string sentence(const Reason& r) {
  const auto v = [&](std::size_t i) { return r.figures.at(i).value; };
  const auto limit = [&] { return r.figures.at(0).limit; };
  switch (r.id) {
    case Rejection::none:
      return {};
    case Rejection::absorbed:
      return "the model's own parameters take all of it";
    case Rejection::chance:
      return fmt::format("chance: p {:.2g} after Holm", v(0));
    case Rejection::placebos:
      return fmt::format("no better than placebos (Wald F {:.1f}, theirs {:.1f})", v(0), limit());
    case Rejection::out_of_range:
      return "outside its physical range";
    case Rejection::too_small:
      return fmt::format("too small to matter ({:.2f} of a size that does)", v(0));
    case Rejection::costs_more:
      return fmt::format("its gain ({:.1f}) does not pay for its {:.0f} parameters", v(0), v(1));
    case Rejection::not_cross_validated:
      return fmt::format("does not hold on blocks that did not estimate it ({:.1f} of {:.1f})", v(0), v(1));
    case Rejection::lesser_cause:
      return fmt::format("{}, too small to matter, leaves Wald F {:.1f} of it", r.effect, v(0));
    case Rejection::refit_failed:
      return "the refit fails: " + r.detail;
    case Rejection::not_converged:
      return "the refit does not converge";
    case Rejection::out_of_iterations:
      return fmt::format("its refit was not done after {:.0f} iterations (--refit-iterations): not judged", v(0));
    case Rejection::at_bound:
      return "the refit ends at the bound of its physical range";
    case Rejection::low_likelihood_gain:
      return fmt::format("Δ log-likelihood of the refit {:.1f} only", v(0));
    case Rejection::chance_after_refit:
      return r.figures.size() == 1
                 ? fmt::format("{:.1f} standard errors after the refit", v(0))
                 : fmt::format("chance after the refit: Wald F {:.1f} of its {:.0f} parameters, p {:.2g}", v(0), v(1), v(2));
    case Rejection::law_not_found:
      return fmt::format("{} is {:.1f} standard errors from none: what the refit finds is another law", r.detail, v(0));
    case Rejection::too_small_after_refit:
      return fmt::format("too small to matter after the refit ({:.2f} of a size that does)", v(0));
    case Rejection::varies:
      return fmt::format("heterogeneous: its size varies by {:.1f} times itself from one stretch of the flights to another", v(0));
    case Rejection::far_behind:
      return fmt::format("explains less than {:.0f} % of what {} does, with the priors' parameters held", 100.0 * limit(), r.effect);
    case Rejection::predicts_less:
      return fmt::format(
          "holds {} within it, and predicts stretches that did not estimate it less well: Δ log-likelihood {:.0f}, {:.0f} without its "
          "further numbers",
          r.effect, v(0), limit());
    case Rejection::law_remainder:
      return fmt::format("may be the unmodelled remainder of the law of {}: {:.0f} % of it is its own", r.effect, 100.0 * v(0));
    case Rejection::mean_of_gusts:
      return fmt::format("a wind of {:.2f} m/s, with gusts of {:.2f} m/s that last {:.1f} s: their mean", v(0), v(1), v(2));
    case Rejection::gusts:
      return fmt::format("Δ log-likelihood {:.1f}; gusts of {:.2f} m/s that last {:.1f} s: {:.1f}", v(0), v(1), v(2), limit());
    case Rejection::not_refitted:
      return "not refitted: those that explain more were, and failed";
    case Rejection::needless:
      return "not significant with what was found after it";
  }
  return {};
}

}  // namespace

std::string words(const Reason& r) { return (r.as.empty() ? "" : "as " + r.as + ": ") + sentence(r); }

}  // namespace rotorloop::diagnose
