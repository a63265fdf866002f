#include "bench/sysid/estimate/fit_problem.hpp"

namespace rotorloop::estimate {

const Estimate* Fit::find(int parameter, int flight) const {
  for (const Estimate& e : estimates) {
    if (e.parameter == parameter && (e.flight == flight || e.flight == -1)) return &e;
  }
  return nullptr;
}

std::string estimate_name(const Estimate& e, const FitProblem& p) {
  const std::string symbol = parameter_info(e.parameter, p.start.terms).symbol;
  return e.flight < 0 ? symbol : symbol + " (" + p.flights[static_cast<std::size_t>(e.flight)]->name + ")";
}

}  // namespace rotorloop::estimate
