#include "bench/hil/flight/hil_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bench/render/digits.hpp"
#include "bench/render/page.hpp"

namespace rotorloop::hil {
namespace {

constexpr double kZoom_s = 2.0;  // length of the RPM window shown in full resolution
std::string shown(double v, int decimals = 2) {
  if (std::isnan(v)) return "–";
  const auto text = fmt::format("{:.{}f}", v, decimals);
  return text.starts_with('-') ? "−" + text.substr(1) : text;
}

// With the digits that the spread over seeds allows; equal seeds have none.
std::string with_spread(double mean, double std, int decimals) {
  return std > 0.0 ? render::measured_text(mean, std) : shown(mean, decimals) + " ± 0";
}

std::string slug(const std::string& text) {
  std::string out;
  for (const char c : text) out += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ? c : '-';
  return out;
}

std::string dot(int colour) { return fmt::format("<span class=\"dot b{}\"></span>", colour % render::kPaletteSize); }

std::string table_html(const std::vector<ReportTableRow>& rows) {
  const bool published = std::any_of(rows.begin(), rows.end(), [](const auto& r) { return !std::isnan(r.published); });
  std::string out =
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\">flight</th><th class=\"l\">controller</th><th>error, cm</th><th>min … "
      "max</th><th>seeds</th><th>reduction</th>";
  if (published) out += "<th>published</th>";
  out += "<th>from estimate</th><th>other axis</th><th>estimator</th></tr></thead><tbody>\n";
  std::string previous;
  for (const auto& r : rows) {
    const bool first = r.flight != previous;
    previous = r.flight;
    const bool several = r.completed > 1;
    out += fmt::format(
        "<tr{}><td class=\"l\">{}</td><td class=\"l\">{}{}</td>", first ? " class=\"first\"" : "",
        first ? fmt::format("{} <span class=\"hash\">{}</span>", render::xml_escaped(r.flight), render::xml_escaped(r.axis)) : "",
        dot(r.colour), render::xml_escaped(r.variant));
    out += fmt::format("<td class=\"big\">{}</td><td>{}</td>", several ? with_spread(r.mean, r.std, 2) : shown(r.mean),
                       several ? shown(r.min) + " … " + shown(r.max) : "");
    out += r.completed == r.flown ? fmt::format("<td>{}</td>", r.flown)
                                  : fmt::format("<td class=\"fail\">{} of {}</td>", r.completed, r.flown);
    out += std::isnan(r.reduction_percent)
               ? "<td></td>"
               : fmt::format("<td>{} %</td>",
                             several ? with_spread(r.reduction_percent, r.reduction_std_percent, 1) : shown(r.reduction_percent, 1));
    if (published)
      out += std::isnan(r.published) ? "<td></td>"
                                     : fmt::format("<td title=\"{}\">{}</td>", render::xml_escaped(r.published_source), shown(r.published));
    out += fmt::format("<td>{}</td><td>{} {}</td><td>{}</td></tr>\n", shown(r.from_estimate), render::xml_escaped(r.other_axis),
                       shown(r.other), shown(r.estimator_error));
  }
  return out + "</tbody></table></div>\n";
}

std::string bars_html(const std::vector<ReportTableRow>& rows) {
  std::string out = "<div class=\"two\">\n";
  for (std::size_t i = 0; i < rows.size();) {
    render::BarChart c;
    c.title = rows[i].flight + ": mean tracking error by controller";
    c.x_label = "mean error " + rows[i].axis + ", cm";
    c.reference_label = "published";
    c.width_px = 500;
    const std::size_t first = i;
    for (; i < rows.size() && rows[i].flight == rows[first].flight; ++i) {
      const auto& r = rows[i];
      render::Bar b{.label = r.variant, .value = r.mean, .spread = {}, .points = r.seeds, .reference = {}, .colour = r.colour};
      if (r.completed > 1) b.spread = r.std;
      if (!std::isnan(r.published)) b.reference = r.published;
      if (!std::isnan(r.limit)) {
        c.limit = r.limit;
        c.limit_label = "limit of " + r.variant;
      }
      c.bars.push_back(std::move(b));
    }
    out += render::figure_html("<b>" + render::xml_escaped(rows[first].flight) + "</b>", render::bar_chart_svg(c));
  }
  return out + "</div>\n";
}

std::string limits_html(const std::vector<ReportLimit>& limits) {
  std::string out =
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\">limit</th><th>measured</th><th>allowed</th><th>margin</th><th "
      "class=\"l\">result</th></tr></thead><tbody>\n";
  for (const auto& l : limits) {
    const double margin = l.upper ? l.limit - l.value : l.value - l.limit;
    const bool measured = !std::isnan(l.value);
    out +=
        fmt::format("<tr><td class=\"l\">{}</td><td class=\"big\">{}{}</td><td>{} {} {}</td><td>{}</td><td class=\"l {}\">{}</td></tr>\n",
                    render::xml_escaped(l.name), shown(l.value), measured ? " " + render::xml_escaped(l.unit) : "", l.upper ? "≤" : "≥",
                    fmt::format("{}", l.limit), render::xml_escaped(l.unit), shown(margin), l.pass ? "pass" : "fail",
                    !measured ? "not measured"
                    : l.pass  ? "pass"
                              : "missed");
  }
  return out + "</tbody></table></div>\n";
}

// Samples of the trajectory that carry its shape: nothing is gained by a point every millimetre.
void thin_path(const std::vector<double>& a, const std::vector<double>& b, double spacing, std::vector<double>& a_out,
               std::vector<double>& b_out) {
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (!std::isfinite(a[i]) || !std::isfinite(b[i])) continue;
    if (!a_out.empty() && i + 1 != a.size() && std::hypot(a[i] - a_out.back(), b[i] - b_out.back()) < spacing) continue;
    a_out.push_back(a[i]);
    b_out.push_back(b[i]);
  }
}

std::string trajectory_html(const ReportFlight& f) {
  constexpr std::array<std::array<std::size_t, 2>, 3> kViews{{{0, 1}, {0, 2}, {1, 2}}};
  constexpr std::array kNames{"from above", "from the right", "from the front"};
  constexpr std::array kAxes{"x, m", "y, m", "z, m"};
  double extent = 0;  // of the longest axis
  for (const auto& axis : f.setpoint_m)
    if (!axis.empty()) {
      const auto [low, high] = std::minmax_element(axis.begin(), axis.end());
      extent = std::max(extent, *high - *low);
    }
  std::string out = "<div class=\"views\">\n";
  for (std::size_t v = 0; v < kViews.size(); ++v) {
    const auto [h, w] = kViews[v];
    render::Plot p;
    p.title = f.name + " seen " + kNames[v];
    p.x_label = kAxes[h];
    p.y_label = kAxes[w];
    p.width_px = 340;
    p.height_px = 320;
    p.equal_axes = true;
    const double spacing = extent / 1000;
    p.min_extent = extent / 4;
    for (const auto& t : f.traces) {
      render::Series s{.label = "", .x = {}, .y = {}, .colour = t.colour, .width_px = 1.4};
      thin_path(t.position_m[h], t.position_m[w], spacing, s.x, s.y);
      p.series.push_back(std::move(s));
    }
    render::Series wanted{.label = "", .x = {}, .y = {}, .colour = render::kNeutral, .dashed = true, .width_px = 1.2};
    thin_path(f.setpoint_m[h], f.setpoint_m[w], spacing, wanted.x, wanted.y);
    p.series.push_back(std::move(wanted));
    out += render::figure_html(kNames[v], render::plot_svg(p));
  }
  return out + "</div>\n";
}

render::Plot time_plot(const ReportFlight& f, const std::string& title, const std::string& y_label) {
  render::Plot p;
  p.title = f.name + ": " + title;
  p.x_label = "time, s";
  p.y_label = y_label;
  if (std::isfinite(f.first_motion_s) && f.last_motion_s > f.first_motion_s) {
    p.bands.push_back({f.first_motion_s, f.last_motion_s, "counted: first to last motion"});
    p.fit_from = f.first_motion_s;  // before take-off the estimate may be anywhere
    p.fit_to = f.last_motion_s;
  }
  return p;
}

std::string errors_html(const ReportFlight& f) {
  render::Plot error = time_plot(f, "tracking error", "error 3-D, cm");
  error.y_from_zero = true;
  render::Plot z = time_plot(f, "vertical error", "error z, cm");
  render::Plot estimator = time_plot(f, "estimator error", "estimate − truth, cm");
  estimator.y_from_zero = true;
  estimator.height_px = 200;
  z.height_px = 220;
  for (const auto& t : f.traces) {
    error.series.push_back({.label = t.variant, .x = t.t_s, .y = t.error_cm, .colour = t.colour});
    z.series.push_back({.label = t.variant, .x = t.t_s, .y = t.error_z_cm, .colour = t.colour});
    estimator.series.push_back({.label = t.variant, .x = t.t_s, .y = t.estimator_error_cm, .colour = t.colour, .width_px = 1.1});
  }
  return render::figure_html("<b>Tracking error</b>: distance of the true centre of mass from the set-point", render::plot_svg(error)) +
         render::figure_html("<b>Vertical error</b>: true minus set-point, positive above", render::plot_svg(z)) +
         render::figure_html("<b>Estimator error</b>: distance of the estimate from the truth; the controller sees the estimate alone",
                             render::plot_svg(estimator));
}

std::string rpm_html(const ReportFlight& f) {
  if (f.traces.empty() || f.traces.back().t_s.empty()) return "";
  const auto& t = f.traces.back();
  render::Plot all;
  all.title = f.name + ": rotor speeds";
  all.x_label = "time, s";
  all.y_label = "10³ RPM";
  const auto kilo = [](std::vector<double> v) {
    for (double& x : v) x /= 1000;
    return v;
  };
  // The window of 2 s with the fastest change of command: there the ESCs are tried hardest.
  double busiest_s = t.t_s.front(), steepest = -1;
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t i = 20; i < std::min(t.t_s.size(), t.rpm_command[r].size()); ++i) {
      const double change = std::fabs(t.rpm_command[r][i] - t.rpm_command[r][i - 20]);
      const bool counted = !(t.t_s[i] < f.first_motion_s || t.t_s[i] > f.last_motion_s);
      if (counted && change > steepest) {
        steepest = change;
        busiest_s = t.t_s[i];
      }
    }
  const double from = std::max(t.t_s.front(), busiest_s - kZoom_s / 2), to = std::min(t.t_s.back(), from + kZoom_s);
  std::string zooms = "<div class=\"two\">\n";
  for (std::size_t r = 0; r < 4; ++r) {
    all.series.push_back(
        {.label = fmt::format("rotor {}", r + 1), .x = t.t_s, .y = kilo(t.rpm[r]), .colour = static_cast<int>(r), .width_px = 1.0});
    render::Plot p;
    p.title = fmt::format("{}: rotor {}", f.name, r + 1);
    p.x_label = "time, s";
    p.y_label = "10³ RPM";
    p.width_px = 500;
    p.height_px = 210;
    p.x_min = from;
    p.x_max = to;
    p.series.push_back(
        {.label = "command", .x = t.t_s, .y = kilo(t.rpm_command[r]), .colour = render::kNeutral, .stepped = true, .width_px = 1.1});
    p.series.push_back(
        {.label = fmt::format("rotor {}", r + 1), .x = t.t_s, .y = kilo(t.rpm[r]), .colour = static_cast<int>(r), .width_px = 1.6});
    zooms += render::figure_html("", render::plot_svg(p));
  }
  return "<h3>Rotor speeds, " + render::xml_escaped(t.variant) + ", seed " + render::xml_escaped(t.seed) + "</h3>\n" +
         render::figure_html("The whole flight", render::plot_svg(all)) +
         fmt::format("<p class=\"cap\">Command and speed in the {:.0f} s around the fastest change of command ({:.2f} s):</p>\n", kZoom_s,
                     busiest_s) +
         zooms + "</div>\n";
}

std::string limiters_html(const ReportFlight& f) {
  std::string out;
  for (const auto& t : f.traces) {
    const auto name = render::xml_escaped(t.variant) + ", seed " + render::xml_escaped(t.seed);
    if (t.limiters.empty()) {
      out += "<p class=\"cap\"><b>" + name + "</b>: no limiter acted.</p>\n";
      continue;
    }
    render::Timeline line;
    line.title = f.name + ": limiters of " + t.variant;
    line.x_label = "time, s";
    line.rows = t.limiters;
    if (!t.t_s.empty()) {
      line.x_min = t.t_s.front();
      line.x_max = t.t_s.back();
    }
    out += render::figure_html("<b>" + name + "</b>", render::timeline_svg(line));
  }
  return "<h3>When limiters acted</h3>\n" + out;
}

std::string buses_html(const ReportFlight& f) {
  if (f.buses.empty()) return "";
  render::Plot p;
  p.title = f.name + ": bus load";
  p.x_label = "time, s";
  p.y_label = "bus load, %";
  p.y_from_zero = true;
  p.height_px = 220;
  std::string formula;
  int colour = 4;
  std::map<double, std::string> marks;
  for (const auto& b : f.buses) {
    p.series.push_back({.label = b.name, .x = b.t_s, .y = b.load_percent, .colour = colour++, .width_px = 1.1});
    if (!std::isnan(b.limit_percent)) {
      auto& m = marks[b.limit_percent];
      m += (m.empty() ? "limit of the mean, " : " and ") + b.name;
    }
    for (const auto& line : b.formula) formula += render::xml_escaped(line) + "\n";
  }
  for (const auto& [y, label] : marks) p.marks.push_back({y, label});
  std::string out = "<h3>Bus load</h3>\n" +
                    render::figure_html("Bus load: share of time that frames occupy the bus, in windows of 10 ms", render::plot_svg(p));
  if (!formula.empty())
    out += "<p class=\"cap\">Worst case, every frame with the most stuff bits it could have:</p>\n<pre>" + formula + "</pre>\n";
  return out;
}

}  // namespace

std::string hil_report_html(const HilReport& r) {
  std::string out = render::page_begin(r.title, "rotorloop hardware-in-the-loop run", "rotorloop HIL");
  out += render::banner_html(r.outcome);
  out += render::facts_html(r.facts);
  if (!r.warnings.empty()) {
    out += "<ul class=\"warn\">";
    for (const auto& w : r.warnings) out += "<li>" + render::xml_escaped(w) + "</li>";
    out += "</ul>\n";
  }
  out += "<nav><a href=\"#tracking\">Tracking</a>";
  if (!r.limits.empty()) out += "<a href=\"#limits\">Limits</a>";
  for (const auto& f : r.flights) out += "<a href=\"#flight-" + slug(f.name) + "\">" + render::xml_escaped(f.name) + "</a>";
  out += "<a href=\"#provenance\">Provenance</a></nav>\n";

  out +=
      "<h2 id=\"tracking\">Tracking</h2>\n<p class=\"cap\">Error is the distance of the true centre of mass from the set-point (|z|: its "
      "vertical part), averaged from the first to the last motion of the trajectory, then over seeds; ± is one standard deviation over "
      "seeds. Reduction is against the first controller of the flight. From estimate: the same error as the estimate shows it. Estimator: "
      "distance of the estimate from the truth, cm.</p>\n";
  out += table_html(r.table) + bars_html(r.table);
  if (!r.limits.empty()) out += "<h2 id=\"limits\">Limits</h2>\n" + limits_html(r.limits);
  for (const auto& f : r.flights) {
    out += "<h2 id=\"flight-" + slug(f.name) + "\">Flight: " + render::xml_escaped(f.name) + "</h2>\n" + render::facts_html(f.facts);
    std::string legend;
    for (const auto& t : f.traces) legend += dot(t.colour) + render::xml_escaped(t.variant) + "&emsp;";
    if (f.traces.empty()) {
      out += "<p class=\"cap\">Of this flight no log is in the folder: there is nothing to plot over time.</p>\n";
      continue;
    }
    out += "<h3>Trajectory</h3>\n<p class=\"cap\">" + legend + "dashed: set-point" +
           (f.traces.empty() ? "" : "; seed " + render::xml_escaped(f.traces.front().seed)) + "</p>\n" + trajectory_html(f);
    out += "<h3>Errors over time</h3>\n" + errors_html(f) + rpm_html(f) + limiters_html(f) + buses_html(f);
  }
  out += "<h2 id=\"provenance\">Provenance</h2>\n" + render::facts_html(r.provenance);
  if (!r.repeat_command.empty())
    out += "<p class=\"cap\">Repeat from inside the run folder:</p>\n<pre>" + render::xml_escaped(r.repeat_command) + "</pre>\n";
  out += "<div class=\"scroll\"><table><thead><tr><th class=\"l\">input</th><th class=\"l\">SHA-256</th></tr></thead><tbody>\n";
  for (const auto& [path, sha] : r.inputs)
    out += "<tr><td class=\"l\">" + render::xml_escaped(path) + "</td><td class=\"l hash\">" + render::xml_escaped(sha) + "</td></tr>\n";
  return out + "</tbody></table></div>\n" + render::page_end();
}

}  // namespace rotorloop::hil
