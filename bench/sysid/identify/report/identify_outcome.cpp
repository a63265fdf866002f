// What an identification comes to, in words.
#include <fmt/format.h>

#include <algorithm>

#include "bench/sysid/identify/report/identify_result.hpp"

namespace rotorloop::identify {

render::Outcome identify_outcome(const Identification& r, const IdentifyAnalysis& a, const IdentifyProvenance& p) {
  if (p.ended) return *p.ended;
  if (!r.fit.converged)
    return {"refused",
            render::Standing::bad,
            "Values and uncertainties are those of the last step, and no answer.",
            {fmt::format("the fit did not converge in {} iterations", r.fit.iterations)},
            "hold what the observability table names (--hold), or look at the findings of the checks"};
  if (a.solver_check && !a.solver_check->good())
    return {
        "refused", render::Standing::bad, "", {solver_check_problem(*a.solver_check)}, "hold what the weakest directions name (--hold)"};
  const auto& estimates = r.fit.estimates;
  const bool model_error =
      std::any_of(estimates.begin(), estimates.end(), [](const estimate::Estimate& e) { return mark_of(e) == "model error"; });
  return {"pass",
          render::Standing::good,
          fmt::format("{} parameters estimated from {} flight{}; the fit converged in {} iterations.", estimates.size(), r.flights.size(),
                      r.flights.size() == 1 ? "" : "s", r.fit.iterations),
          {},
          model_error ? "rotorloop diagnose names the effect that the model lacks where a parameter is marked “model error”"
                      : "fly with it: rotorloop hil SCENARIO --vehicle FILE, the file that -o names"};
}

}  // namespace rotorloop::identify
