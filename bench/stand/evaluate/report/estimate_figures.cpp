// Drawings of an estimate: visible without scripts, the same bytes for the same data.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"
#include "bench/render/zoom_plot.hpp"
#include "bench/stand/evaluate/report/estimate_document.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
constexpr int kHalfWidth_px = 510;

std::string coefficient_figure(const CoefficientEstimate& c) {
  render::Plot p;
  p.title = fmt::format("{} over ω²: points with ± 2 u of the step, the fitted law, and its value with 95 %", c.name);
  p.x_label = "ω², 10⁶ rad²/s²";
  p.width_px = kHalfWidth_px;
  p.height_px = 300;
  // Coefficients are some 1e-8 in SI units: the axis counts in the power of ten of the value, so that its figures are short.
  const double power = std::floor(std::log10(std::abs(c.value))), scale = std::pow(10.0, -power);
  p.y_label = fmt::format("{}, 1e{:.0f} {}", c.name, power, render::unit_text(c.unit));
  render::Series bars, up, down, law;
  bars.width_px = 1.0;
  bars.colour = render::kNeutral;
  up.label = "speed from below";
  up.marker = render::Marker::dot;
  up.colour = 0;
  down.label = "from above";
  down.marker = render::Marker::ring;
  down.colour = 1;
  law.label = "law";
  law.colour = 2;
  double low = 1e300, high = 0.0;
  const double spread = c.fit.rms;
  for (Eigen::Index i = 0; i < c.rows.y.size(); ++i) {
    const double w = c.rows.omega_rad_s(i);
    if (!(w > 0.0)) continue;
    low = std::min(low, w);
    high = std::max(high, w);
    const double x = 1e-6 * w * w, y = scale * of_rotor_alone(c, i) / (w * w),
                 u = scale * 2.0 * (c.rows.u(i) == c.rows.u(i) ? c.rows.u(i) : spread) / (w * w);
    bars.x.insert(bars.x.end(), {x, x, kGap});
    bars.y.insert(bars.y.end(), {y - u, y + u, kGap});
    render::Series& s = c.rows.direction(i) < 0.0 ? down : up;
    s.x.push_back(x);
    s.y.push_back(y);
  }
  for (int k = 0; k <= 60; ++k) {
    const double w = low + (high - low) * k / 60.0, l = std::log(w / c.rows.centre_rad_s);
    law.x.push_back(1e-6 * w * w);

    law.y.push_back(scale * c.value *
                    std::exp((c.fit.value("exponent") + (c.fit.value("curvature") + c.fit.value("change of curvature") * l) * l) * l));
  }
  const double x = 1e-6 * c.rows.centre_rad_s * c.rows.centre_rad_s;
  render::Series value{"value, 95 %", {x, x}, {scale * c.low, scale * c.high}, 3, false, false, 4.0, render::Marker::none};
  p.series = {bars, up, down, law, value};
  return render::figure_html(p.title, render::plot_svg(p));
}

std::string residual_figure(const CoefficientEstimate& c) {
  render::Plot p;
  const bool thrust = c.name == "c_t";
  p.title = fmt::format("Residuals of {}", c.channel);
  p.x_label = "rotor speed, rad/s";
  p.y_label = thrust ? "residual, mN" : "residual, mN m";
  p.width_px = kHalfWidth_px;
  p.height_px = 260;
  render::Series good, odd;
  good.marker = odd.marker = render::Marker::dot;
  good.label = "step";
  odd.label = "down-weighted";
  odd.colour = 3;
  for (Eigen::Index i = 0; i < c.rows.y.size(); ++i) {
    render::Series& s = c.fit.weight(i) < 0.3 ? odd : good;
    s.x.push_back(c.rows.omega_rad_s(i));
    s.y.push_back(1e3 * c.fit.residual(i));
  }
  p.series = {good};
  if (!odd.x.empty()) p.series.push_back(odd);
  p.marks = {{0.0, ""}};
  return render::figure_html(p.title, render::plot_svg(p));
}

// Up less down, with the fitted hysteresis still in it: the loop that friction in the mount draws.
std::string hysteresis_figure(const CoefficientEstimate& c) {
  if (!c.fit.law.hysteresis) return "";
  render::Plot p;
  const bool thrust = c.name == "c_t";
  p.title = fmt::format("Hysteresis of {}: what is left of the steps without the fitted hysteresis taken out", c.channel);
  p.x_label = "rotor speed, rad/s";
  p.y_label = thrust ? "mN" : "mN m";
  p.width_px = kHalfWidth_px;
  p.height_px = 260;
  render::Series up{"from below", {}, {}, 0}, down{"from above", {}, {}, 1};
  const double h = c.fit.value("hysteresis");
  std::vector<std::pair<double, double>> of_up, of_down;
  for (Eigen::Index i = 0; i < c.rows.y.size(); ++i) {
    const double s = c.rows.direction(i);
    if (s != 0.0) (s > 0.0 ? of_up : of_down).emplace_back(c.rows.omega_rad_s(i), 1e3 * (c.fit.residual(i) + h * s));
  }
  for (auto* v : {&of_up, &of_down}) {
    std::sort(v->begin(), v->end());
    render::Series& s = v == &of_up ? up : down;
    for (const auto& [x, y] : *v) {
      s.x.push_back(x);
      s.y.push_back(y);
    }
  }
  p.series = {up, down};
  return render::figure_html(p.title, render::plot_svg(p));
}

std::string budget_figure(const CoefficientEstimate& c) {
  render::BarChart chart;
  chart.title = fmt::format("Budget of {}: standard uncertainty by term", c.name);
  chart.x_label = "u, % of " + c.name;
  chart.width_px = kHalfWidth_px;
  for (const BudgetTerm& b : c.budget)
    chart.bars.push_back({b.name,
                          100.0 * b.u,
                          std::nullopt,
                          {},
                          std::nullopt,
                          b.kind == BudgetKind::A ? 0
                          : b.source == "typical" ? 4
                                                  : 2});
  chart.bars.push_back({"combined", 100.0 * c.u / c.value, std::nullopt, {}, std::nullopt, 3});
  return render::figure_html(chart.title, render::bar_chart_svg(chart));
}

}  // namespace

std::string estimate_figures(const StandEstimate& e) {
  std::string out;
  for (const auto* c : {e.thrust ? &*e.thrust : nullptr, e.torque ? &*e.torque : nullptr}) {
    if (!c) continue;
    out += "<div class=\"two\">\n" + coefficient_figure(*c) + residual_figure(*c) + hysteresis_figure(*c) + budget_figure(*c) + "</div>\n";
  }
  return out;
}

std::string sample_figures(const StandEstimate& e) {
  const SampleSeries& v = e.samples;
  if (v.empty()) return "";
  const auto plot = [&](const std::string& title, const std::string& unit, std::vector<render::Series> series) {
    render::Plot p;
    p.title = title + " over the run";
    p.x_label = "time, s";
    p.y_label = title + ", " + unit;
    p.series = std::move(series);
    p.height_px = 220;
    return p;
  };
  std::vector<double> rpm, wanted_rpm;
  for (std::size_t i = 0; i < v.t_s.size(); ++i) {
    rpm.push_back(v.omega_rad_s[i] * kRpm_per_rad_s);
    wanted_rpm.push_back(v.target_rad_s[i] * kRpm_per_rad_s);
  }
  std::vector<render::Plot> plots{plot("speed", "RPM", {{"measured", v.t_s, rpm, 1}, {"commanded", v.t_s, wanted_rpm, 0, true}})};
  const auto measured = [](const std::vector<double>& y) {
    return std::any_of(y.begin(), y.end(), [](double x) { return std::isfinite(x); });
  };
  if (!measured(wanted_rpm)) plots[0].series.pop_back();
  if (measured(v.thrust_N)) plots.push_back(plot("thrust", "N", {{"thrust", v.t_s, v.thrust_N, 2}}));
  if (measured(v.torque_N_m)) plots.push_back(plot("torque", "N m", {{"torque", v.t_s, v.torque_N_m, 3}}));
  return render::zoom_figures_html(plots);
}

}  // namespace rotorloop::stand
