#include "bench/sysid/identify/report/report_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/render/document.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"

namespace rotorloop::identify {
namespace {

constexpr int kHalf_px = 500;  // two figures beside each other
constexpr std::size_t kPointsPerLine = 1500;

// Of the power of a thousand that leaves 1 to 1000 of a number; 0 where it reads well as it is.
int short_exponent(double largest) {
  if (!(largest > 0.0) || (largest >= 0.01 && largest < 1e5)) return 0;
  return 3 * static_cast<int>(std::floor(std::log10(largest) / 3.0));
}
std::string superscript(int n) {
  constexpr const char* kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string out;
  for (const char c : std::to_string(n)) out += c == '-' ? "⁻" : kDigits[c - '0'];
  return out;
}

// What opacity and colour say: a row of cells from -1 to 1.
std::string correlation_legend(double left, double y, double cell) {
  std::string out;
  for (int k = 0; k <= 8; ++k) {
    const double c = 0.25 * (k - 4);
    out +=
        fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"12\" style=\"fill:var(--c{});fill-opacity:{:.2f};stroke:var(--line)\"/>",
                    render::px(left + k * cell), render::px(y), render::px(cell), c < 0.0 ? 1 : 0, std::fabs(c));
    if (k % 4 == 0)
      out += fmt::format("<text class=\"tk\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", render::px(left + (k + 0.5) * cell),
                         render::px(y + 26.0),
                         k == 0   ? "−1"
                         : k == 4 ? "0"
                                  : "+1");
  }
  return out + fmt::format("<text class=\"lg\" x=\"{}\" y=\"{}\">correlation: blue below zero, orange above</text>\n",
                           render::px(left + 9 * cell + 12.0), render::px(y + 10.0));
}

}  // namespace

std::string autocorrelation_figure(const FlightWhiteness& w) {
  render::Plot p;
  p.title = w.flight + ": autocorrelation of the innovations";
  p.x_label = "lag, s";
  p.y_label = "correlation";
  p.width_px = kHalf_px;
  double n = 0.0;
  for (std::size_t c = 0; c < w.channels.size(); ++c) {
    render::Series s{
        .label = w.channels[c].channel, .x = {}, .y = {}, .colour = static_cast<int>(c % render::kPaletteSize), .width_px = 1.0};
    for (std::size_t k = 1; k < w.channels[c].correlation.size(); ++k) {
      s.x.push_back(w.channels[c].lag_s[k]);
      s.y.push_back(w.channels[c].correlation[k]);
    }
    p.series.push_back(std::move(s));
  }
  for (std::size_t k = 0; k < w.second_s.size(); ++k) n += 1.0 / w.step_s;
  const double band = n > 0.0 ? 2.0 / std::sqrt(n) : 0.0;
  p.marks = {{band, "2/√n"}, {-band, ""}};
  p.y_min = -0.2;
  p.y_max = 0.2;
  for (const render::Series& s : p.series) {
    for (const double y : s.y) {
      p.y_min = std::min(*p.y_min, 1.1 * y);
      p.y_max = std::max(*p.y_max, 1.1 * y);
    }
  }
  return render::figure_html("<b>Autocorrelation</b>; white noise stays within ± 2/√n in 95 % of the lags.", render::plot_svg(p));
}

std::string cost_figure(const FlightWhiteness& w) {
  render::Plot p;
  p.title = w.flight + ": mean square of the innovations in each second";
  p.x_label = "time, s";
  p.y_label = "mean square";
  p.width_px = kHalf_px;
  p.y_from_zero = true;
  p.y_max = 2.0;
  for (const double v : w.cost_per_number) p.y_max = std::max(*p.y_max, 1.1 * v);
  p.series.push_back({.label = "", .x = w.second_s, .y = w.cost_per_number, .colour = 0, .stepped = true});
  p.marks = {{1.0, "model"}};
  return render::figure_html("<b>Mean square</b> in each second: above 1 lies what the model lacks or the noise figures deny.",
                             render::plot_svg(p));
}

std::string innovation_figure(const std::string& flight, const std::vector<estimate::Innovation>& all) {
  std::string out = "<div class=\"two\">\n";
  constexpr const char* kNames[] = {"x", "y", "z", "roll", "pitch", "yaw"};
  for (int group = 0; group < 2; ++group) {
    render::Plot p;
    p.title = flight + (group == 0 ? ": innovations of position" : ": innovations of attitude");
    p.x_label = "time, s";
    p.y_label = "standard deviations";
    p.width_px = kHalf_px;
    p.y_min = -6.0;
    p.y_max = 6.0;
    const std::size_t thin = std::max<std::size_t>(1, all.size() / kPointsPerLine);
    for (int axis = 0; axis < 3; ++axis) {
      render::Series s{.label = kNames[3 * group + axis], .x = {}, .y = {}, .colour = axis, .width_px = 0.8};
      for (std::size_t i = 0; i < all.size(); i += thin) {
        s.x.push_back(all[i].t_s);
        s.y.push_back(all[i].value[3 * group + axis]);
      }
      p.series.push_back(std::move(s));
    }
    p.marks = {{2.0, ""}, {-2.0, ""}};
    out += render::figure_html(
        fmt::format("<b>{}</b>, {}; lines at ± 2", render::xml_escaped(flight), group == 0 ? "position" : "attitude"), render::plot_svg(p));
  }
  return out + "</div>\n";
}

// One square for each pair; strength by opacity, sign by colour. Numbers stand in strong cells, in the colour of the paper.
std::string correlation_map(const Identification& r) {
  const auto n = static_cast<int>(r.fit.estimates.size());
  constexpr double kCell = 26.0, kCharacter = 6.6, kSteep = 0.87, kFlat = 0.5;  // sine and cosine of the labels' 60 degrees
  std::size_t longest = 12;
  for (const estimate::Estimate& e : r.fit.estimates) longest = std::max(longest, estimate::estimate_name(e, r.problem).size());
  const double label_px = kCharacter * static_cast<double>(longest);
  constexpr double kLegend = 50.0, kLegendText = 280.0;
  const double left = label_px + 20.0, top = kSteep * label_px + 20.0;
  const double width = left + std::max(n * kCell + kFlat * label_px, 9 * kCell + kLegendText);
  std::string out = render::open_svg(static_cast<int>(width), top + n * kCell + kLegend, "correlations between the estimates");
  for (int a = 0; a < n; ++a) {
    const std::string label = render::xml_escaped(estimate::estimate_name(r.fit.estimates[static_cast<std::size_t>(a)], r.problem));
    const double middle = kCell * (a + 0.5);
    out += fmt::format("<text class=\"tk\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>\n", render::px(left - 6.0),
                       render::px(top + middle + 4.0), label);
    out += fmt::format("<text class=\"tk\" x=\"{0}\" y=\"{1}\" transform=\"rotate(-60 {0} {1})\">{2}</text>\n", render::px(left + middle),
                       render::px(top - 6.0), label);
    for (int b = 0; b < n; ++b) {
      const double c = r.fit.covariance(a, b) / std::sqrt(r.fit.covariance(a, a) * r.fit.covariance(b, b));
      const double strength = std::min(std::fabs(c), 1.0);
      out += fmt::format(
          "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" style=\"fill:var(--c{});fill-opacity:{:.2f};stroke:var(--line)\"/>\n",
          render::px(left + b * kCell), render::px(top + a * kCell), render::px(kCell), render::px(kCell), c < 0.0 ? 1 : 0,
          a == b ? 0.15 : strength);
      if (a != b && strength > 0.895)
        out +=
            fmt::format("<text class=\"tk\" x=\"{}\" y=\"{}\" text-anchor=\"middle\" style=\"font-size:9px;fill:var(--paper)\">{}</text>\n",
                        render::px(left + (b + 0.5) * kCell), render::px(top + middle + 3.0),
                        render::xml_escaped(fmt::format("{}{:.2f}", c < 0.0 ? "−" : "", strength)));
    }
  }
  return out + correlation_legend(left, top + n * kCell + 16.0, kCell) + "</svg>\n";
}

std::string history_figure(const std::vector<HistoryPoint>& history, const std::vector<HistoryReference>& references,
                           const std::string& parameter, const std::string& unit) {
  render::Plot p;
  p.title = parameter + " over trials";
  p.x_label = "trial";
  p.width_px = kHalf_px;
  p.height_px = 240;
  render::Series value{.label = "", .x = {}, .y = {}, .colour = 0, .marker = render::Marker::dot};
  render::Series bars{.label = "", .x = {}, .y = {}, .colour = 0};
  for (std::size_t t = 0; t < history.size(); ++t) {
    p.x_names.push_back(history[t].label);
    const auto found = std::find(history[t].names.begin(), history[t].names.end(), parameter);
    if (found == history[t].names.end()) continue;
    const auto i = static_cast<std::size_t>(found - history[t].names.begin());
    const double x = static_cast<double>(t + 1);
    value.x.push_back(x);
    value.y.push_back(history[t].value[i]);
    for (const double sign : {-2.0, 2.0}) {
      bars.x.push_back(x);
      bars.y.push_back(history[t].value[i] + sign * history[t].u[i]);
    }
    bars.x.push_back(NAN);
    bars.y.push_back(NAN);
  }
  // In the legend, not beside the line: lines of several files often coincide.
  p.x_min = 0.5;
  p.x_max = static_cast<double>(history.size()) + 0.5;
  std::vector<render::Series> lines;
  for (const HistoryReference& r : references) {
    const auto said = r.value.find(parameter);
    if (said == r.value.end()) continue;
    lines.push_back({.label = r.label,
                     .x = {*p.x_min, *p.x_max},
                     .y = {said->second, said->second},
                     .colour = static_cast<int>(1 + lines.size()),
                     .dashed = true});
  }
  double largest = 0.0;
  for (const double y : bars.y) largest = std::isfinite(y) ? std::max(largest, std::fabs(y)) : largest;
  const int exponent = short_exponent(largest);
  const double scale = std::pow(10.0, -exponent);
  lines.push_back(std::move(bars));
  lines.push_back(std::move(value));
  for (render::Series& s : lines) {
    for (double& y : s.y) y *= scale;
  }
  p.series = std::move(lines);
  const std::string shown =
      exponent == 0 ? render::unit_text(unit) : fmt::format("10{} {}", superscript(exponent), render::unit_text(unit));
  p.y_label = parameter + (shown == "1" ? "" : ", " + shown);
  return render::figure_html("<b>" + render::xml_escaped(parameter) + "</b>", render::plot_svg(p));
}

}  // namespace rotorloop::identify
