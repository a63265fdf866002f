#include "bench/sysid/diagnose/residuals/residual_findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/render/digits.hpp"
#include "bench/sysid/diagnose/residuals/flight_inputs.hpp"
#include "host/base/constants.hpp"
#include "host/effects/term_size.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr std::size_t kMostSteps = 3;
constexpr double kAverage_s = 0.2;  // of what is regressed and judged as a whole: above some 2 Hz the measurements' own noise rules
constexpr double kBandStandsOut = 2.0;

Axes averaged(const Samples& samples, Axes axes) {
  for (auto& axis : axes) axis = sliding_mean(samples, axis, kAverage_s);
  return axes;
}

void add_words(ResidualFindings& f) {
  const Samples& samples = f.series.samples;
  for (std::size_t n = 0; n < std::min(kMostSteps, f.steps.events.size()); ++n) {
    const auto& event = f.steps.events[n];
    const TimeStep& s = f.steps.steps[event.front()];
    std::string others;
    for (std::size_t i = 1; i < event.size(); ++i) {
      const TimeStep& o = f.steps.steps[event[i]];
      if (o.effect != s.effect && others.find(o.effect) == std::string::npos) others += (others.empty() ? "" : ", ") + o.effect;
    }
    f.words.push_back(fmt::format("{} changes at {:.1f} s of {}: {} by {} {} (p {:.1e}){}.", s.effect, s.at_s, samples.flights[s.flight],
                                  s.parameter, render::measured_text(s.size, s.u), s.unit, s.p_holm,
                                  others.empty() ? "" : "; the same moment would suit " + others));
  }
  if (f.steps.events.size() > kMostSteps)
    f.words.push_back(fmt::format("{} further steps in time pass.", f.steps.events.size() - kMostSteps));
  for (const LagFinding& l : f.lag.findings) f.words.push_back(l.words);
  for (const VarianceEffect& e : f.variance.effects) {
    if (!e.found) continue;
    std::string aliases;
    for (const auto& [id, c] : e.aliases) aliases += (aliases.empty() ? "" : ", ") + id;
    f.words.push_back(fmt::format("The scatter changes as by {} ({} about {:.2g} {}, p {:.1e}){}.",
                                  e.id.empty() ? e.what + ", which is no effect of the library" : e.id + ": " + e.what, e.parameter, e.size,
                                  e.unit, e.p_holm, aliases.empty() ? "" : "; hard to distinguish from " + aliases));
  }
  for (std::size_t a = 0; a < kAxes; ++a) {
    for (const SpectrumBand& b : f.spectra.axis[a].bands) {
      if (b.rms > kBandStandsOut * b.rms_expected && b.rms_expected > 0.0)
        f.words.push_back(fmt::format("Between {:.3g} and {:.3g} Hz {} is {:.1f} times what the noise figures expect ({:.2g} {}).",
                                      b.from_Hz, b.to_Hz, kAxisNames[a], b.rms / b.rms_expected, b.rms, kAxisUnits[a]));
    }
  }
  for (std::size_t a = 0; a < kAxes; ++a) {
    const AxisUnexplained& x = f.unexplained.axis[a];
    if (f.unexplained.kind[a] == ResidualKind::systematic) {
      std::string by;
      for (std::size_t i = 0; i < std::min<std::size_t>(2, x.explainable.curves.size()); ++i)
        by += (by.empty() ? "" : " and ") + f.series.inputs[x.explainable.curves[i].input].name;
      f.words.push_back(fmt::format("{:.0f} % of the power of the residual {} is predictable on blocks that had no part in it{}.",
                                    100.0 * x.explainable.share, kAxisNames[a], by.empty() ? "" : ", most by " + by));
    } else if (f.unexplained.kind[a] == ResidualKind::bursts) {
      f.words.push_back(fmt::format("{:.0f} % of the power of the residual {} comes in bursts.", 100.0 * x.burst_share, kAxisNames[a]));
    } else if (f.unexplained.kind[a] == ResidualKind::stochastic) {
      f.words.push_back(fmt::format(
          "The residual {} ({:.2g} {} rms, {:.2g} by the noise figures) is not predictable from any regressor: consistent with noise.",
          kAxisNames[a], x.rms, kAxisUnits[a], x.rms_expected));
    }
  }
}

}  // namespace

double size_that_matters(std::size_t axis, const estimate::ModelValues& vehicle, const Criteria& criteria) {
  const double weight_N = vehicle[estimate::kMass] * kGravity_m_s2;
  return axis < 3 ? criteria.force_matters * weight_N : criteria.torque_matters * weight_N * host::arm_m(vehicle.geometry);
}

ResidualFindings analyse_residuals(const identify::Identification& result, const ResidualOptions& o) {
  ResidualFindings f;
  SeriesOptions series;
  series.seed = o.seed;
  series.logs = o.logs;
  f.series = residual_series(result, series);
  ResidualSeries& s = f.series;
  SpectrumOptions spectrum;
  f.spectra = spectra(s.samples, s.free, std::span(s.simulated).first(std::min<std::size_t>(8, s.simulated.size())), s.inputs, spectrum);
  DependenceOptions dependence_options;
  dependence_options.seed = o.seed;
  const Axes slow = averaged(s.samples, s.free);
  std::vector<Axes> slow_simulated;
  for (const Axes& a : s.simulated) slow_simulated.push_back(averaged(s.samples, a));
  f.dependence = dependence(s.samples, slow, slow_simulated, s.inputs, dependence_options);
  LagOptions lag;
  lag.seed = o.seed;
  f.lag = lag_analysis(s.samples, s.model, s.free, lag);
  for (Channel& c : products_of_motion(s.inputs)) s.inputs.push_back(std::move(c));
  f.unexplained = unexplained(s.samples, slow, slow_simulated, s.inputs, {.fit = {}, .criteria = o.criteria});
  f.variance = variance_effects(s, variance_kinds(s), {.criteria = o.criteria});
  StepOptions steps;
  steps.seed = o.seed;
  for (std::size_t a = 0; a < kAxes; ++a) steps.matters[a] = size_that_matters(a, result.problem.start, o.criteria);
  f.steps = steps_in_time(s, step_kinds(s.state), steps);
  add_words(f);
  s.simulated.clear();
  s.state.clear();
  s.whitened = {};
  return f;
}

}  // namespace rotorloop::diagnose
