#include "bench/sysid/diagnose/rejection.hpp"

namespace rotorloop::diagnose {

std::string_view name(Rejection r) {
  constexpr std::string_view kNames[]{"none",
                                      "absorbed",
                                      "chance",
                                      "placebos",
                                      "out_of_range",
                                      "too_small",
                                      "costs_more",
                                      "not_cross_validated",
                                      "lesser_cause",
                                      "refit_failed",
                                      "not_converged",
                                      "out_of_iterations",
                                      "at_bound",
                                      "low_likelihood_gain",
                                      "chance_after_refit",
                                      "law_not_found",
                                      "too_small_after_refit",
                                      "varies",
                                      "far_behind",
                                      "predicts_less",
                                      "law_remainder",
                                      "mean_of_gusts",
                                      "gusts",
                                      "not_refitted",
                                      "needless"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(Rejection::needless) + 1);
  return kNames[static_cast<std::size_t>(r)];
}

}  // namespace rotorloop::diagnose
