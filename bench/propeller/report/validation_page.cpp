// The page of a validation: verdict and limits, then for each propeller what was measured (points) against the solve before
// (dashed) and after the fit (full lines).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bench/propeller/report/validation_output.hpp"
#include "bench/render/outcome.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"

namespace rotorloop::propeller {
namespace {
constexpr int kLinePoints = 60;
constexpr double kSpeedStep_rpm = 500.0;  // sweeps within it share a colour

std::string percent_cell(double v) { return std::isnan(v) ? "–" : fmt::format("{:.1f}", 100.0 * v); }

double value_of(const MeasuredRow& r, bool power) { return power ? r.cp : r.ct; }
double value_of(const Coefficients& c, bool power) { return power ? c.cp : c.ct; }

render::Series measured_points(const std::vector<MeasuredRow>& rows, bool over_j, bool power, int colour, render::Marker marker) {
  render::Series s;
  s.colour = colour;
  s.marker = marker;
  for (const MeasuredRow& r : rows) {
    s.x.push_back(over_j ? r.j : r.rpm / 1000.0);
    s.y.push_back(value_of(r, power));
  }
  return s;
}

render::Series model_line(const sim::Rotor& rotor, double diameter_m, const std::vector<MeasuredRow>& rows, bool over_j, bool power,
                          int colour, bool fitted) {
  render::Series s;
  s.colour = colour;
  s.dashed = !fitted;
  s.width_px = fitted ? 1.6 : 1.1;
  const auto [low, high] = std::minmax_element(
      rows.begin(), rows.end(), [&](const MeasuredRow& a, const MeasuredRow& b) { return over_j ? a.j < b.j : a.rpm < b.rpm; });
  for (int i = 0; i < kLinePoints; ++i) {
    const double w = static_cast<double>(i) / (kLinePoints - 1);
    const MeasuredRow at{low->rpm + w * (high->rpm - low->rpm), low->j + w * (high->j - low->j), 0.0, 0.0};
    s.x.push_back(over_j ? at.j : at.rpm / 1000.0);
    s.y.push_back(value_of(predict(rotor, diameter_m, at), power));
  }
  return s;
}

// One figure: static rows over rotor speed, or all sweeps over J.
std::string figure(const PropellerResult& p, const sim::Rotor& unfitted, const sim::Rotor& fitted, bool over_j, bool power) {
  render::Plot plot;
  plot.title = fmt::format("{}: {} over {}", p.propeller.entry.title, power ? "C_P" : "C_T", over_j ? "advance ratio" : "rotor speed");
  plot.x_label = over_j ? "advance ratio J = V/(nD)" : "rotor speed, 10³ RPM";
  plot.y_label = power ? "C_P" : "C_T";
  plot.width_px = 510;
  plot.height_px = 320;
  plot.y_from_zero = !over_j;
  plot.x_min = 0.0;
  plot.x_max = 0.0;
  std::map<double, int> colours;  // rounded rotor speed -> colour
  for (const MeasuredSet& set : p.propeller.sets) {
    const bool is_sweep = &set != &p.propeller.sets.front();
    if (is_sweep != over_j) continue;
    const double speed = std::round(set.rows.front().rpm / kSpeedStep_rpm) * kSpeedStep_rpm;
    const bool first = colours.emplace(over_j ? speed : 0.0, static_cast<int>(colours.size())).second;
    const int colour = colours[over_j ? speed : 0.0];
    const double d = p.propeller.entry.diameter_m;
    for (const MeasuredRow& r : set.rows) plot.x_max = std::max(*plot.x_max, 1.03 * (over_j ? r.j : r.rpm / 1000.0));
    plot.series.push_back(model_line(unfitted, d, set.rows, over_j, power, colour, false));
    plot.series.push_back(model_line(fitted, d, set.rows, over_j, power, colour, true));
    if (first) plot.series.back().label = over_j ? fmt::format("{:.0f} RPM", speed) : "static";
    plot.series.push_back(measured_points(rows_of(set, Part::held_out), over_j, power, colour, render::Marker::dot));
    plot.series.push_back(measured_points(rows_of(set, Part::fitted), over_j, power, colour, render::Marker::ring));
  }
  return render::figure_html(plot.title, render::plot_svg(plot));
}

std::string scores_html(const GeometryResult& g) {
  std::string out =
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\">rms error, %</th><th class=\"l\">rows are</th><th>rows</th><th>C_T "
      "unfitted</th><th>C_P unfitted</th><th>C_T fitted</th><th>C_P fitted</th></tr></thead><tbody>\n";
  for (const SetScore& s : g.scores) {
    const bool counts = g.judged && s.judged && s.part == Part::held_out && (s.is_static || s.whole);
    out += fmt::format(
        "<tr><td class=\"l\">{0}</td><td class=\"l\">{1}</td><td>{2}</td><td>{3}</td><td>{4}</td><td{7}>{5}</td><td{7}>{6}</td></tr>\n",
        render::xml_escaped(s.label),
        s.part == Part::fitted ? "fitted"
        : s.whole              ? "held out, whole sweep"
                               : "held out",
        s.fitted.rows, percent_cell(s.unfitted.ct), percent_cell(s.unfitted.cp), percent_cell(s.fitted.ct), percent_cell(s.fitted.cp),
        counts ? " class=\"big\"" : "");
  }
  return out + "</tbody></table></div>\n";
}

std::string fit_html(const GeometryResult& g) {
  std::string out;
  const auto parameters = blade_parameters();
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    out += fmt::format("{}{} {:.2f}", k == 0 ? "" : ", ", parameters[k].name, g.fit.values[k]);
    out += g.fit.at_bound[k] ? " (at its bound)" : fmt::format(" ± {:.2f}", g.fit.standard_errors[k]);
    if (parameters[k].unit != "1") out += " " + parameters[k].unit;
  }
  return out + fmt::format("; misfit of the fitted rows {} %", percent_cell(g.fit.rms));
}

std::string propeller_html(const PropellerResult& p) {
  const auto& e = p.propeller.entry;
  std::string out = fmt::format("<h2>{}{}</h2>\n", render::xml_escaped(e.title), e.judged ? "" : " (printed only)");
  out += fmt::format("<p class=\"cap\">Section {}{}: {}.</p>\n", render::xml_escaped(e.section.inner),
                     e.section.outer.empty() ? "" : " to " + render::xml_escaped(e.section.outer), render::xml_escaped(e.section.reason));
  const auto shown = std::min_element(p.geometries.begin(), p.geometries.end(),
                                      [](const GeometryResult& a, const GeometryResult& b) { return a.fit.rms < b.fit.rms; });
  const sim::Rotor unfitted(shown->unfitted_blade), fitted(shown->fitted_blade);
  out += "<div class=\"two\">\n";
  for (const bool over_j : {false, true})
    for (const bool power : {false, true}) out += figure(p, unfitted, fitted, over_j, power);
  out += "</div>\n";
  for (const GeometryResult& g : p.geometries)
    out += fmt::format("<p>Geometry from the <b>{}</b>{}: {}.</p>\n", g.source,
                       &g == &*shown && p.geometries.size() > 1 ? " (smaller misfit; in the plots)" : "", fit_html(g)) +
           scores_html(g);
  return out;
}

std::string limits_html(const std::vector<ValidationLimit>& limits) {
  std::string out =
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\">limit on held-out rows, after the fit</th><th>measured</th><th>allowed</th>"
      "<th class=\"l\">result</th></tr></thead><tbody>\n";
  for (const ValidationLimit& l : limits)
    out += fmt::format("<tr><td class=\"l\">{}</td><td>{} %</td><td>{} {} %</td><td class=\"l {}\">{}</td></tr>\n",
                       render::xml_escaped(l.name), percent_cell(l.measured), l.at_least ? "≥" : "≤", percent_cell(l.limit),
                       l.pass ? "pass" : "fail", l.pass ? "pass" : "missed");
  return out + "</tbody></table></div>\n";
}
}  // namespace

std::string validation_html(const ValidationDocument& d) {
  const bool pass = all_pass(d.limits);
  const auto missed = std::count_if(d.limits.begin(), d.limits.end(), [](const ValidationLimit& l) { return !l.pass; });
  std::string out = render::page_begin("BEM rotor model against measured propellers", "rotorloop rotor validate", "rotorloop");
  render::Outcome outcome{.verdict = pass ? "pass" : "fail", .standing = pass ? render::Standing::good : render::Standing::bad};
  outcome.sentence = d.limits.empty() ? "nothing judged"
                     : pass           ? fmt::format("all {} limits met", d.limits.size())
                                      : fmt::format("{} of {} limits missed", missed, d.limits.size());
  for (const ValidationLimit& l : d.limits)
    if (!l.pass)
      outcome.errors.push_back(fmt::format("limit missed: {}: {}, allowed {} {}", l.name, percent_cell(l.measured),
                                           l.at_least ? "at least" : "at most", percent_cell(l.limit)));
  outcome.next = pass ? "simulate with these rotors; docs/acceptance/rotor_validation.md has the limits"
                      : "look at the propeller below whose curve lies beside its rings and dots";
  out += render::banner_html(outcome);
  out +=
      "<p>Thrust and power coefficients, C_T = T/(ρn²D⁴), C_P = P/(ρn³D⁵), measured by the UIUC Propeller Database (Brandt, Deters, "
      "Ananda, "
      "Dantsker, Selig), against the blade-element-momentum solve with nothing fitted (dashed) and with four scalars fitted (full lines): "
      "pitch offset, lift scale, drag scale, stall delay. Rings: rows that were fitted, every second of the static table and of one sweep. "
      "Dots: held out. Error: rms of (model − measured)/measured over rows with C_T above 0.01.</p>\n";
  if (!d.limits.empty()) out += limits_html(d.limits);
  for (const PropellerResult& p : d.results) out += propeller_html(p);
  out += fmt::format("<h2>Provenance</h2>\n<p class=\"cap\">{}; drag with delayed stall {:g}; <code>{}</code></p>\n",
                     render::xml_escaped(d.version), d.stall_drag, render::xml_escaped(d.command));
  return out + render::page_end();
}

}  // namespace rotorloop::propeller
