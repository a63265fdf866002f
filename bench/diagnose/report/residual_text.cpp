// What the residuals say, for the terminal.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/diagnose/residuals/residual_findings.hpp"

namespace rotorloop::diagnose {
namespace {

std::string power_table(const ResidualFindings& f) {
  std::string out = "missing wrench        rms  expected   foretold  by chance  in bursts  kind";
  std::string bands;
  for (const SpectrumBand& b : f.spectra.axis[0].bands) bands += fmt::format("  {:.3g}-{:.3g} Hz", b.from_Hz, b.to_Hz);
  out += (bands.empty() ? "" : "   over expected in" + bands) + "\n";
  for (std::size_t a = 0; a < kAxes; ++a) {
    const AxisUnexplained& x = f.unexplained.axis[a];
    out += fmt::format("{:<9} [{:<3}]  {:>9.3g} {:>9.3g} {:>9.1f}% {:>9.1f}% {:>9.1f}%  {:<10}", kAxisNames[a], kAxisUnits[a], x.rms,
                       x.rms_expected, 100.0 * x.explainable.share, 100.0 * x.explainable_by_chance, 100.0 * x.burst_share,
                       name(f.unexplained.kind[a]));
    for (const SpectrumBand& b : f.spectra.axis[a].bands)
      out += fmt::format(" {:>9.2f}", b.rms_expected > 0.0 ? b.rms / b.rms_expected : 0.0);
    out += "\n";
  }
  return out;
}

std::string input_table(const ResidualFindings& f) {
  std::string out = "depends on                                      axis       share  chance\n";
  std::size_t n = 0;
  for (const Dependence& d : f.dependence.ranking) {
    if (!(d.share > 2.0 * d.chance && d.share > 0.02) || n++ >= 12) continue;
    out += fmt::format("{:<47} {:<9} {:>5.1f}%  {:>5.1f}%\n", f.series.inputs[d.input].name, kAxisNames[d.axis], 100.0 * d.share,
                       100.0 * std::max(0.0, d.chance));
  }
  if (n == 0) return "no input foretells any axis of the missing wrench\n";
  if (n > 12) out += fmt::format("… and {} more\n", n - 12);
  return out;
}

std::string lag_table(const ResidualFindings& f) {
  std::string out = "measured behind the model   lag, ms    95 %            share  at no lag\n";
  for (const AxisLag& l : f.lag.axis) {
    if (l.tried_s.empty()) return "";
    out += l.known ? fmt::format("{:<25} {:>9.1f}  {:>6.1f} … {:<6.1f} {:>6.3f} {:>9.3f}\n", kAxisNames[l.axis], 1e3 * l.lag_s,
                                 1e3 * l.low_s, 1e3 * l.high_s, l.share, l.share_at_zero)
                   : fmt::format("{:<25}  not told by these flights\n", kAxisNames[l.axis]);
  }
  return out;
}

std::string variance_table(const ResidualFindings& f) {
  std::string out = "changes of scatter                                                        t   p (Holm)   one step\n";
  for (const VarianceEffect& e : f.variance.effects) {
    const std::string what = e.id.empty() ? e.what : e.id;
    out += e.untested.empty() ? fmt::format("{:<65} {:>9.2f}  {:>9.2g}   {:.2g} ± {:.2g} {}{}\n", what, e.t, e.p_holm, e.size, e.u, e.unit,
                                            e.found ? "  found" : "")
                              : fmt::format("{:<65}  not tested: {}\n", what, e.untested);
  }
  return out;
}

std::string step_table(const ResidualFindings& f) {
  if (f.steps.events.empty()) return "no step in time\n";
  std::string out = "step in time          flight               at, s  parameter                 size        u         p (Holm)\n";
  for (const auto& event : f.steps.events) {
    for (const std::size_t i : event) {
      const TimeStep& s = f.steps.steps[i];
      out += fmt::format("{}{:<20} {:<20} {:>5.1f}  {:<20} {:>9.3g} {:>9.2g} {:<4} {:>9.1e}\n", i == event.front() ? "" : "  ", s.effect,
                         f.series.samples.flights[s.flight], s.at_s, s.parameter, s.size, s.u, s.unit, s.p_holm);
    }
  }
  return out;
}

std::string telemetry_table(const ResidualFindings& f) {
  if (f.series.telemetry.empty()) return "";
  std::string out = "reading less model     flight                 mean x, y, z                     rms x, y, z\n";
  for (const TelemetryResidual& t : f.series.telemetry) {
    out += fmt::format("{:<22} {:<20} {:>9.3g} {:>9.3g} {:>9.3g}  {:>9.3g} {:>9.3g} {:>9.3g} {}{}\n", t.stream, t.flight, t.mean[0],
                       t.mean[1], t.mean[2], t.rms[0], t.rms[1], t.rms[2], t.unit, t.fitted ? "" : " (not in the fit)");
  }
  return out;
}

}  // namespace

std::string residual_table(const ResidualFindings& f) {
  std::string out = power_table(f) + "\n" + input_table(f) + "\n" + lag_table(f) + "\n" + variance_table(f) + "\n" + step_table(f) + "\n" +
                    telemetry_table(f) + "\n";
  for (const std::string& w : f.words) out += "- " + w + "\n";
  return out;
}

}  // namespace rotorloop::diagnose
