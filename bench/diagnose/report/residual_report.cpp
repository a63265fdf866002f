// The residual sections of the report: findings in words first, then the evidence in tables and drawings.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/diagnose/report/residual_figures.hpp"
#include "bench/diagnose/residuals/residual_findings.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_pieces.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr std::size_t kMostFigures = 6;

std::string num(double v, const char* format = "{:.3g}") {
  if (!std::isfinite(v)) return "–";
  std::string text = fmt::format(fmt::runtime(format), v);
  for (std::size_t at = text.find('-'); at != std::string::npos; at = text.find('-', at + 3)) text.replace(at, 1, "−");
  return text;
}
std::string cell(const std::string& text, const char* kind = "") { return fmt::format("<td{}>{}</td>", kind, text); }
std::string left(const std::string& text) { return cell(render::xml_escaped(text), " class=\"l\""); }
std::string head(const std::vector<std::string>& names) {
  std::string out = "<div class=\"scroll\"><table><thead><tr>";
  for (std::size_t i = 0; i < names.size(); ++i) out += fmt::format("<th{}>{}</th>", i == 0 ? " class=\"l\"" : "", render::xml_escaped(names[i]));
  return out + "</tr></thead><tbody>\n";
}
constexpr const char* kTableEnd = "</tbody></table></div>\n";

std::string power_html(const ResidualFindings& f) {
  std::string out =
      "<p>Force and torque that the model lacks, from a pass in which the readings alone decide, averaged over 0.2 s "
      "(bands and curves over time: as they are). “Expected” is what the same pass makes of "
      "noise of the fitted figures; “foretold” the share of the power that smooth functions of the motion, rotors and time explain on "
      "flights or blocks that had no part in them.</p>\n";
  std::vector<std::string> names{"missing", "unit", "rms", "expected", "foretold, %", "by chance, %", "in bursts, %", "kind"};
  for (const SpectrumBand& b : f.spectra.axis[0].bands) names.push_back(fmt::format("{:.3g}–{:.3g} Hz", b.from_Hz, b.to_Hz));
  out += head(names);
  for (std::size_t a = 0; a < kAxes; ++a) {
    const AxisUnexplained& x = f.unexplained.axis[a];
    out += "<tr>" + left(kAxisNames[a]) + left(kAxisUnits[a]) + cell(num(x.rms), " class=\"big\"") + cell(num(x.rms_expected)) +
           cell(num(100.0 * x.explainable.share, "{:.1f}")) + cell(num(100.0 * x.explainable_by_chance, "{:.1f}")) +
           cell(num(100.0 * x.burst_share, "{:.1f}")) + left(std::string(name(f.unexplained.kind[a])));
    for (const SpectrumBand& b : f.spectra.axis[a].bands)
      out += cell(b.rms_expected > 0.0 ? num(b.rms / b.rms_expected, "{:.2f}") + " ×" : "–");
    out += "</tr>\n";
  }
  out += kTableEnd;
  if (f.spectra.frequency_Hz.empty()) return out;
  out += "<div class=\"two\">\n";
  for (std::size_t a = 0; a < kAxes; ++a) out += spectrum_figure(f, a);
  out += "</div>\n";
  std::string rows;
  for (std::size_t a = 0; a < kAxes; ++a) {
    for (std::size_t i = 0; i < std::min<std::size_t>(3, f.spectra.axis[a].coherence.size()); ++i) {
      const InputCoherence& c = f.spectra.axis[a].coherence[i];
      rows += "<tr>" + left(kAxisNames[a]) + left(f.series.inputs[c.input].name) + cell(fmt::format("{:.3g}–{:.3g}", c.from_Hz, c.to_Hz)) +
              cell(num(c.coherence, "{:.2f}")) + cell(num(c.chance, "{:.2f}")) + "</tr>\n";
    }
  }
  if (rows.empty()) return out + "<p>No input is coherent with it in any band beyond chance.</p>\n";
  return out + head({"missing", "moves with", "band, Hz", "coherence", "by chance 1 %"}) + rows + kTableEnd;
}

std::string dependence_html(const ResidualFindings& f) {
  std::string out, rows;
  std::size_t n = 0;
  for (const Dependence& d : f.dependence.ranking) {
    if (!(d.share > 2.0 * d.chance && d.share > 0.02) || n >= 2 * kMostFigures) continue;
    rows += "<tr>" + left(f.series.inputs[d.input].name) + left(kAxisNames[d.axis]) + cell(num(100.0 * d.share, "{:.1f}")) +
            cell(num(100.0 * std::max(0.0, d.chance), "{:.1f}")) + "</tr>\n";
    if (n++ < kMostFigures && !d.bins.empty()) out += dependence_figure(f, d);
  }
  const std::string title = "<h3>What it depends on</h3>\n";
  if (n == 0) return title + "<p>No single input foretells any axis beyond chance.</p>\n";
  std::string all =
      title + head({"input", "missing", "foretold, %", "by chance, %"}) + rows + kTableEnd + "<div class=\"two\">\n" + out + "</div>\n";
  std::string curves;
  std::size_t drawn = 0;
  for (std::size_t a = 0; a < kAxes; ++a) {
    if (f.unexplained.kind[a] != ResidualKind::systematic) continue;
    for (std::size_t i = 0; i < std::min<std::size_t>(2, f.unexplained.axis[a].explainable.curves.size()) && drawn < kMostFigures;
         ++i, ++drawn)
      curves += curve_figure(f, a, f.unexplained.axis[a].explainable.curves[i]);
  }
  if (!curves.empty()) all += "<h3>Parts of the additive fit</h3>\n<div class=\"two\">\n" + curves + "</div>\n";
  std::string maps;
  for (const PlaceMap& m : f.dependence.maps) maps += place_figure(m);
  if (!maps.empty()) all += "<h3>By place</h3>\n<div class=\"two\">\n" + maps + "</div>\n";
  return all;
}

std::string lag_html(const ResidualFindings& f) {
  std::string out = "<h3>Does it lead or follow?</h3>\n";
  for (const LagFinding& l : f.lag.findings) out += "<p>" + render::xml_escaped(l.words) + "</p>\n";
  if (f.lag.findings.empty()) out += "<p>No axis leads or follows the model beyond its interval.</p>\n";
  out += head({"axis", "lag, ms", "95 %", "share", "at no lag", "slope"});
  for (const AxisLag& l : f.lag.axis) {
    out += "<tr>" + left(kAxisNames[l.axis]);
    out += l.known ? cell(num(1e3 * l.lag_s, "{:.1f}"), " class=\"big\"") +
                         cell(num(1e3 * l.low_s, "{:.1f}") + " … " + num(1e3 * l.high_s, "{:.1f}"))
                   : cell("–") + cell("not told");
    out += cell(num(l.share)) + cell(num(l.share_at_zero)) + cell(num(l.slope)) + "</tr>\n";
  }
  out += kTableEnd;
  if (!f.lag.axis[0].tried_s.empty()) out += "<div class=\"two\">" + lag_figure(f, false) + lag_figure(f, true) + "</div>\n";
  return out;
}

std::string variance_html(const ResidualFindings& f) {
  std::string out =
      "<h3>Does its scatter change?</h3>\n<p>Score of a variance that the model lacks, after the noise figures of each flight took their "
      "share. Sizes are one step from zero: an order of magnitude when large.</p>\n";
  out += head({"effect", "what would scatter", "t", "p (Holm)", "size", "u", "unit", "hard to tell from", ""});
  for (const VarianceEffect& e : f.variance.effects) {
    std::string twins;
    for (const auto& [id, c] : e.twins) twins += fmt::format("{}{} ({:.2f})", twins.empty() ? "" : ", ", id, c);
    out += "<tr>" + left(e.id.empty() ? "no effect of the library" : e.id) + left(e.what);
    out += e.untested.empty()
               ? cell(num(e.t, "{:.2f}")) + cell(num(e.p_holm, "{:.2g}")) + cell(num(e.size, "{:.2g}")) + cell(num(e.u, "{:.1g}")) +
                     left(e.unit) + left(twins) + cell(e.found ? "found" : "", " class=\"l fail\"")
               : cell("–") + cell("–") + cell("–") + cell("–") + left(e.unit) + left("not tested: " + e.untested) + cell("");
    out += "</tr>\n";
  }
  return out + kTableEnd;
}

std::string steps_html(const ResidualFindings& f) {
  std::string out = "<h3>Does it change at a moment?</h3>\n";
  if (f.steps.events.empty())
    return out + "<p>No step in force, torque, thrust or centre of mass passes at 1 % over all flights and kinds.</p>\n";
  out += head({"effect", "flight", "at, s", "parameter", "step", "u", "unit", "p (Holm)"});
  std::string figures;
  for (const auto& event : f.steps.events) {
    for (const std::size_t i : event) {
      const TimeStep& s = f.steps.steps[i];
      out += (i == event.front() ? "<tr class=\"first\">" : "<tr>") + left(s.effect) + left(f.series.samples.flights[s.flight]) +
             cell(num(s.at_s, "{:.1f}")) + left(s.parameter) + cell(num(s.size), " class=\"big\"") + cell("± " + num(s.u, "{:.2g}")) +
             left(s.unit) + cell(num(s.p_holm, "{:.1e}")) + "</tr>\n";
    }
    figures += step_figure(f, f.steps.steps[event.front()]);
  }
  return out + kTableEnd + "<div class=\"two\">\n" + figures + "</div>\n";
}

std::string telemetry_html(const ResidualFindings& f) {
  if (f.series.telemetry.empty()) return "";
  std::string out = "<h3>Gyro and accelerometer against the model</h3>\n" +
                    head({"stream", "flight", "unit", "mean x", "y", "z", "rms x", "y", "z", "assumed x", "y", "z", ""});
  for (const TelemetryResidual& t : f.series.telemetry) {
    out += "<tr>" + left(t.stream) + left(t.flight) + left(t.unit);
    for (Eigen::Index a = 0; a < 3; ++a) out += cell(num(t.mean[a]));
    for (Eigen::Index a = 0; a < 3; ++a) out += cell(num(t.rms[a]));
    for (Eigen::Index a = 0; a < 3; ++a) out += cell(t.fitted ? num(t.assumed[a]) : "–");
    out += left(t.fitted ? "" : "not in the fit") + "</tr>\n";
  }
  return out + kTableEnd;
}

}  // namespace

std::string residual_sections_html(const ResidualFindings& f) {
  std::string out = "<h2 id=\"wrench\">The wrench that the model lacks</h2>\n";
  if (!f.words.empty()) {
    out += "<ul>\n";
    for (const std::string& w : f.words) out += "<li>" + render::xml_escaped(w) + "</li>\n";
    out += "</ul>\n";
  }
  out += power_html(f);
  out += "<h3>Over time</h3>\n";
  for (std::size_t i = 0; i < f.series.samples.flights.size(); ++i) out += wrench_figures(f, i) + burst_figure(f, i);
  return out + dependence_html(f) + lag_html(f) + variance_html(f) + steps_html(f) + telemetry_html(f);
}

}  // namespace rotorloop::diagnose
