#include "bench/identify/report/diagnostics_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace rotorloop::identify {

std::string whiteness_table(const std::vector<FlightWhiteness>& flights) {
  if (flights.empty()) return "";
  std::string out = "Innovations of the poses (rms 1 and no correlation under the model; p of Ljung-Box at 0.1, 0.5, 2 s, of runs):\n";
  for (const FlightWhiteness& f : flights) {
    for (const ChannelWhiteness& c : f.channels) {
      out += fmt::format("  {:<20} {:<6} rms {:5.3f}", f.flight, c.channel, c.rms);
      for (const PortmanteauTest& t : c.ljung_box) out += fmt::format("  {:7.1e}", t.p);
      out += fmt::format("  {:7.1e}{}\n", c.runs.p, c.white ? "" : "  not white");
    }
  }
  return out;
}

std::string homogeneity_table(const Identification& r, const IdentifyAnalysis& a) {
  const Homogeneity& h = a.homogeneity;
  if (h.degrees <= 0.0) return "";
  std::string out = fmt::format("Between the flights: χ² {:.1f} on {:.0f} degrees of freedom, p {:.2g}", h.chi2, h.degrees, h.p);
  if (a.inflation > 1.05) out += fmt::format(" (variances taken {:.1f} times the classical ones, for correlated residuals)", a.inflation);
  out += "\n";
  for (const ParameterHomogeneity& p : h.parameters) {
    if (!p.moved) continue;
    const estimate::ParameterInfo info = estimate::parameter_info(p.parameter, r.problem.start.terms);
    out += fmt::format("  {} differs between flights (p {:.2g}):", info.symbol, p.p);
    for (std::size_t f = 0; f < p.value.size(); ++f) {
      if (std::isfinite(p.u[f])) out += fmt::format(" {} {:.4g} ± {:.2g};", r.flights[f].name, p.value[f], p.u[f]);
    }
    out += fmt::format(" try --per-flight {}\n", info.name);
  }
  return out;
}

std::string direction_text(const estimate::OpenDirection& d) {
  std::string out;
  for (const auto& [name, share] : d.parts) out += fmt::format("{}{} ({:+.2f})", out.empty() ? "" : ", ", name, share);
  return out;
}

std::string observability_table(const Observability& o) {
  std::string out = fmt::format("Information, scaled to unit diagonal: condition {:.2g}; weakest directions:\n", o.condition);
  for (const estimate::OpenDirection& d : o.weakest) out += fmt::format("  {:8.2g}  {}\n", d.information, direction_text(d));
  if (!o.correlated.empty()) {
    out += "Strong correlations:";
    for (const CorrelatedPair& c : o.correlated) out += fmt::format(" {}~{} {:+.3f};", c.first, c.second, c.correlation);
    out.back() = '\n';
  }
  for (const FlightContribution& f : o.flights) {
    if (!f.cannot_tell.empty() && o.flights.size() > 1)
      out += fmt::format("{} alone ({:.0f} s) cannot tell {}\n", f.flight, f.seconds, fmt::join(f.cannot_tell, ", "));
  }
  for (const Advice& a : o.advice) out += fmt::format("{}: {}. Fly: {}\n", a.parameter, a.why, a.manoeuvre);
  return out;
}

}  // namespace rotorloop::identify
