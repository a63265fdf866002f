#include "bench/sysid/diagnose/report/residual_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/render/disk_map.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr int kHalf_px = 500;
constexpr double kHighest_Hz = 30.0;
constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

std::string label(std::size_t axis) { return fmt::format("{}, {}", kAxisNames[axis], kAxisUnits[axis]); }

// Lines at mean and edges of a band of 95 %.
void add_band(render::Plot& p, const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& low,
              const std::vector<double>& high) {
  p.series.push_back({.label = "", .x = x, .y = low, .colour = 0, .dashed = true, .width_px = 0.8});
  p.series.push_back({.label = "", .x = x, .y = high, .colour = 0, .dashed = true, .width_px = 0.8});
  p.series.push_back({.label = "", .x = x, .y = y, .colour = 0, .width_px = 1.8});
}

}  // namespace

std::string wrench_figures(const ResidualFindings& f, std::size_t flight) {
  std::string out = "<div class=\"two\">\n";
  const Samples& samples = f.series.samples;
  for (std::size_t group = 0; group < 2; ++group) {
    render::Plot p;
    p.title = samples.flights[flight] + (group == 0 ? ": residual force" : ": residual torque");
    p.x_label = "time, s";
    p.y_label = group == 0 ? "force, N" : "torque, N m";
    p.width_px = kHalf_px;
    for (std::size_t axis = 3 * group; axis < 3 * group + 3; ++axis) {
      render::Series s{.label = kAxisNames[axis], .x = {}, .y = {}, .colour = static_cast<int>(axis - 3 * group), .width_px = 0.9};
      for (const Piece& piece : samples.pieces) {
        if (piece.flight != flight) continue;
        for (std::size_t i = 0; i < piece.count; ++i) {
          s.x.push_back(piece.start_s + static_cast<double>(i) * piece.step_s);
          s.y.push_back(f.series.free[axis][piece.first + i]);
        }
        s.x.push_back(kGap);
        s.y.push_back(kGap);
      }
      p.series.push_back(std::move(s));
    }
    out += render::figure_html(
        fmt::format("<b>{}</b>, residual {}", render::xml_escaped(samples.flights[flight]), group == 0 ? "force" : "torque"),
        render::plot_svg(p));
  }
  return out + "</div>\n";
}

std::string spectrum_figure(const ResidualFindings& f, std::size_t axis) {
  render::Plot p;
  p.title = std::string("power density of the missing ") + kAxisNames[axis];
  p.x_label = "frequency, Hz";
  p.y_label = fmt::format("10 log₁₀ ({})²/Hz", kAxisUnits[axis]);
  p.width_px = kHalf_px;
  const AxisSpectrum& x = f.spectra.axis[axis];
  render::Series found{.label = "residual", .x = {}, .y = {}, .colour = 0},
      expected{.label = "noise of the fit", .x = {}, .y = {}, .colour = render::kNeutral, .dashed = true};
  for (std::size_t j = 0; j < f.spectra.frequency_Hz.size() && f.spectra.frequency_Hz[j] <= kHighest_Hz; ++j) {
    for (auto [series, value] : {std::pair{&found, x.density[j]}, std::pair{&expected, x.density_expected[j]}}) {
      series->x.push_back(f.spectra.frequency_Hz[j]);
      series->y.push_back(value > 0.0 ? 10.0 * std::log10(value) : kGap);
    }
  }
  p.series = {std::move(found), std::move(expected)};
  return render::figure_html(fmt::format("<b>{}</b>: where the line lies above the dashed one something is missing", kAxisNames[axis]),
                             render::plot_svg(p));
}

std::string dependence_figure(const ResidualFindings& f, const Dependence& d) {
  const Channel& input = f.series.inputs[d.input];
  render::Plot p;
  p.title = fmt::format("residual {} against {}", kAxisNames[d.axis], input.name);
  p.x_label = fmt::format("{}, {}", input.name, input.unit);
  p.y_label = label(d.axis);
  p.width_px = kHalf_px;
  std::vector<double> x, y, low, high;
  for (const DependenceBin& b : d.bins) {
    x.push_back(b.centre);
    y.push_back(b.mean);
    low.push_back(b.low);
    high.push_back(b.high);
  }
  add_band(p, x, y, low, high);
  p.marks = {{0.0, ""}};
  return render::figure_html(fmt::format("<b>{}</b> against {}: {:.0f} % of its power predicted on other blocks", kAxisNames[d.axis],
                                         render::xml_escaped(input.name), 100.0 * d.share),
                             render::plot_svg(p));
}

std::string curve_figure(const ResidualFindings& f, std::size_t axis, const PartialCurve& c) {
  const Channel& input = f.series.inputs[c.input];
  render::Plot p;
  p.title = fmt::format("part of {} in the residual {}", input.name, kAxisNames[axis]);
  p.x_label = fmt::format("{}, {}", input.name, input.unit);
  p.y_label = label(axis);
  p.width_px = kHalf_px;
  std::vector<double> low, high;
  for (std::size_t i = 0; i < c.at.size(); ++i) {
    low.push_back(c.value[i] - 2.0 * c.u[i]);
    high.push_back(c.value[i] + 2.0 * c.u[i]);
  }
  add_band(p, c.at, c.value, low, high);
  p.marks = {{0.0, ""}};
  return render::figure_html(
      fmt::format("<b>{}</b>, part of {} beside all other inputs; ± 2 u over folds", kAxisNames[axis], render::xml_escaped(input.name)),
      render::plot_svg(p));
}

std::string lag_figure(const ResidualFindings& f, bool torque) {
  render::Plot p;
  p.title = torque ? "how well the model's torque explains the measured one, by lag"
                   : "how well the model's force explains the measured one, by lag";
  p.x_label = "measured behind the model, ms";
  p.y_label = "explained share";
  p.width_px = kHalf_px;
  p.y_min = 0.0;
  p.y_max = 1.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const AxisLag& l = f.lag.axis[i + (torque ? 3 : 0)];
    render::Series s{.label = fmt::format("{}{}", kAxisNames[l.axis], l.known ? fmt::format(" ({:.0f} ms)", 1e3 * l.lag_s) : ""),
                     .x = {},
                     .y = {},
                     .colour = static_cast<int>(i)};
    for (std::size_t j = 0; j < l.tried_s.size(); ++j) {
      s.x.push_back(1e3 * l.tried_s[j]);
      s.y.push_back(l.shares[j]);
    }
    p.series.push_back(std::move(s));
  }
  p.bands = {{-1e3, 0.0, "before its cause", render::kNeutral}};
  p.x_min = -200.0;
  p.x_max = 200.0;
  return render::figure_html(torque ? "<b>Torque</b>: a top on the left leads its cause" : "<b>Force</b>", render::plot_svg(p));
}

std::string step_figure(const ResidualFindings& f, const TimeStep& s) {
  render::Plot p;
  p.title = fmt::format("{} in {}: a step at each moment", s.effect, f.series.samples.flights[s.flight]);
  p.x_label = "time, s";
  p.y_label = "χ² of a step";
  p.width_px = kHalf_px;
  p.y_from_zero = true;
  p.series.push_back({.label = "", .x = s.tried_s, .y = s.chi2_at, .colour = 0});
  p.marks = {{s.limit, "1 % of blocks in random order"}};
  return render::figure_html(fmt::format("<b>{}</b>, {} in {}: {:.1f} s", render::xml_escaped(s.effect), render::xml_escaped(s.parameter),
                                         render::xml_escaped(f.series.samples.flights[s.flight]), s.at_s),
                             render::plot_svg(p));
}

std::string burst_figure(const ResidualFindings& f, std::size_t flight) {
  render::Timeline t;
  t.title = "bursts in " + f.series.samples.flights[flight];
  t.x_label = "time, s";
  t.x_min = 1e300;
  t.x_max = -1e300;
  for (const Piece& p : f.series.samples.pieces) {
    if (p.flight != flight) continue;
    t.x_min = std::min(t.x_min, p.start_s);
    t.x_max = std::max(t.x_max, p.start_s + static_cast<double>(p.count) * p.step_s);
  }
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    render::TimelineRow row{.label = kAxisNames[axis], .intervals = {}, .colour = static_cast<int>(axis % 3)};
    for (const Burst& b : f.unexplained.bursts) {
      if (b.flight == flight && b.axis == axis) row.intervals.push_back({b.from_s, b.to_s});
    }
    if (!row.intervals.empty()) t.rows.push_back(std::move(row));
  }
  if (t.rows.empty()) return "";
  return render::figure_html(
      fmt::format("<b>{}</b>: when the residual is far above its usual size", render::xml_escaped(f.series.samples.flights[flight])),
      render::timeline_svg(t));
}

// Cells seen from above, x to the right; the colour runs over ± the largest mean.
std::string place_figure(const PlaceMap& m) {
  constexpr double kCell = 34.0, kLeft = 60.0, kTop = 14.0;
  double largest = 0.0;
  for (const double v : m.mean) {
    if (std::isfinite(v)) largest = std::max(largest, std::fabs(v));
  }
  if (!(largest > 0.0)) return "";
  const double width = kLeft + kCell * static_cast<double>(m.columns) + 20.0, height = kTop + kCell * static_cast<double>(m.rows) + 46.0;
  std::string svg = render::open_svg(static_cast<int>(width), height, std::string("mean missing ") + kAxisNames[m.axis] + " by place");
  for (std::size_t row = 0; row < m.rows; ++row) {
    const double y = kTop + kCell * static_cast<double>(m.rows - 1 - row);
    for (std::size_t column = 0; column < m.columns; ++column) {
      const double v = m.mean[row * m.columns + column];
      if (!std::isfinite(v)) continue;
      const render::Rgb c = render::field_colour(0.5 + 0.5 * v / largest);
      svg += fmt::format(
          "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"rgb({},{},{})\"><title>{:.3g} ± {:.2g} {}</title></rect>\n",
          render::px(kLeft + kCell * static_cast<double>(column)), render::px(y), render::px(kCell - 1.0), render::px(kCell - 1.0), c.r,
          c.g, c.b, v, m.u[row * m.columns + column], kAxisUnits[m.axis]);
    }
    svg += fmt::format("<text class=\"tk\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{:.1f}</text>\n", render::px(kLeft - 6.0),
                       render::px(y + 0.5 * kCell + 4.0), m.y_from_m + (static_cast<double>(row) + 0.5) * m.cell_m);
  }
  for (std::size_t column = 0; column < m.columns; ++column)
    svg += fmt::format("<text class=\"tk\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{:.1f}</text>\n",
                       render::px(kLeft + kCell * (static_cast<double>(column) + 0.5)), render::px(height - 30.0),
                       m.x_from_m + (static_cast<double>(column) + 0.5) * m.cell_m);
  svg += fmt::format("<text class=\"tk\" x=\"{}\" y=\"{}\">x, m; y upward, m; colour ± {:.2g} {}</text>\n</svg>\n", render::px(kLeft),
                     render::px(height - 10.0), largest, kAxisUnits[m.axis]);
  return render::figure_html(fmt::format("<b>{}</b> by place, mean over visits", kAxisNames[m.axis]), svg);
}

}  // namespace rotorloop::diagnose
