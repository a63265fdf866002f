// What a reader of the figures must know first: marks of estimates, and warnings.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/sysid/identify/report/identify_result.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kModelErrorRatio = 5.0;
constexpr std::size_t kBlocksEach = 2;  // of a parameter: below, the scatter of so few holds too little
constexpr double kContradicted = 2.0;   // standard deviations of the prior

// Where the fit's own answer was not taken, and why.
std::vector<IdentifyWarning> inertia_warnings(const Identification& r) {
  std::vector<IdentifyWarning> out;
  for (const InertiaByBand& axis : r.inertia.axes) {
    if (!axis.taken) continue;
    const estimate::ParameterInfo info = estimate::parameter_info(axis.parameter, r.problem.start.terms);
    std::string why = "where the fit over all frequencies found none";
    if (axis.u_joint > 0.0) {
      const bool against = std::fabs(axis.value - axis.joint) > 3.0 * std::hypot(axis.u, axis.u_joint);
      why = fmt::format("{} the fit over all frequencies, {:.3g} ± {:.1g}", against ? "against" : "surer than", axis.joint, axis.u_joint);
      if (against) why += ": a moment of low frequency is missing in the model";
    }
    out.push_back({info.symbol, fmt::format("{:.3g} ± {:.1g} {} is that of {:g} to {:g} Hz, {}", axis.value, axis.u, info.unit,
                                            axis.from_Hz, axis.to_Hz, why)});
  }
  for (const estimate::Estimate& e : r.wanted) {
    const estimate::ParameterInfo info = estimate::parameter_info(e.parameter, r.problem.start.terms);
    out.push_back(
        {info.symbol,
         fmt::format("the flights want {:.3g} ± {:.1g} {}, which cannot be: held at the nearest that can; the model lacks an effect",
                     e.value, std::max(e.u, e.u_robust), info.unit)});
  }
  return out;
}

}  // namespace

std::string mark_of(const estimate::Estimate& e) {
  if (e.at_bound) return "at its bound";
  if (e.prior_share > 0.5 && std::fabs(e.prior_z) > kContradicted) return "contradicted";
  if (e.prior_share > 0.5) return e.parameter == estimate::kMass ? "weighed" : "not identified";
  if (e.u > 0.0 && e.u_robust >= kModelErrorRatio * e.u) return "model error";
  return "";
}

std::string blocks_note(const estimate::Fit& fit) {
  if (fit.blocks >= kBlocksEach * fit.estimates.size()) return "";
  return fmt::format(
      "robust u rests on {} blocks of residuals for {} parameters, fewer than two each: too small; longer flights or shorter blocks "
      "(--block)",
      fit.blocks, fit.estimates.size());
}

std::vector<IdentifyWarning> warnings_of(const Identification& r, const IdentifyAnalysis& a) {
  std::vector<IdentifyWarning> out;
  const auto warn = [&](const std::string& where, const std::string& what) { out.push_back({where, what}); };
  if (!r.fit.converged) warn("fit", "did not converge: values and uncertainties are those of the last step");
  if (const std::string note = blocks_note(r.fit); !note.empty()) warn("robust u", note);
  if (!r.fit.noise_settled) warn("noise", "the rounds ran out before every noise figure came to rest");
  if (a.solver_check && !a.solver_check->good()) warn("solver", solver_check_problem(*a.solver_check));
  if (r.start.thrust_scale != 1.0)
    warn("start values",
         fmt::format("thrust and torque of the vehicle file were multiplied by {:.3g} to carry the weight", r.start.thrust_scale));
  for (const estimate::Estimate& e : r.fit.estimates) {
    if (const std::string mark = mark_of(e); !mark.empty() && mark != "weighed") warn(estimate::estimate_name(e, r.problem), mark);
  }
  for (const auto& [where, what] : inertia_warnings(r)) warn(where, what);
  for (const std::string& line : a.written_differences) warn("vehicle file", line);
  for (const StageComparison& c : r.comparison) {
    if (!c.agrees)
      warn(fmt::format("stage {}", name(c.role)), fmt::format("{} is {:+.1f} standard uncertainties from the joint fit",
                                                              estimate::parameter_info(c.parameter, r.problem.start.terms).symbol, c.z));
  }
  for (const FlightWhiteness& w : a.whiteness) {
    if (!w.white()) warn(w.flight, "innovations are not white: the model lacks something in this flight, or the noise is not white");
  }
  for (const ParameterHomogeneity& h : a.homogeneity.parameters) {
    if (h.moved)
      warn("between flights", estimate::parameter_info(h.parameter, r.problem.start.terms).symbol + " is not the same in all flights");
  }
  return out;
}

}  // namespace rotorloop::identify
