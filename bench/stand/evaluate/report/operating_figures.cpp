// What a motor with its propeller gives and costs, as data sheets draw it: over rotor speed, and over the voltage of the motor.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"
#include "bench/stand/evaluate/report/estimate_document.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::stand {
namespace {

using OperatingPoints = std::vector<OperatingPoint>;
using OperatingValue = std::function<double(const OperatingPoint&)>;

struct Abscissa {
  std::string name, label;
  OperatingValue value;
};
struct Ordinate {
  std::string name;  // in the legend, where a figure has two
  OperatingValue value;
  int colour;
};
struct OperatingFigure {
  std::string title, unit;
  std::vector<Ordinate> of;
};

bool any(const OperatingPoints& points, const OperatingValue& value) {
  return std::any_of(points.begin(), points.end(), [&](const OperatingPoint& p) { return std::isfinite(value(p)); });
}

// Each step as a point, the means of its levels joined.
void add(render::Plot& p, const OperatingPoints& points, const OperatingPoints& levels, const Abscissa& x, const Ordinate& y, bool alone) {
  render::Series dots, line;
  dots.marker = render::Marker::dot;
  dots.colour = line.colour = y.colour;
  line.label = alone ? "" : y.name;
  for (const OperatingPoint& o : points) {
    dots.x.push_back(x.value(o));
    dots.y.push_back(y.value(o));
  }
  for (const OperatingPoint& o : levels) {
    line.x.push_back(x.value(o));
    line.y.push_back(y.value(o));
  }
  p.series.push_back(line);
  p.series.push_back(dots);
}

std::string figure(const OperatingFigure& f, const OperatingPoints& points, const OperatingPoints& levels, const Abscissa& x) {
  render::Plot p;
  p.title = f.title + " over " + x.name;
  p.x_label = x.label;
  p.y_label = f.title + ", " + f.unit;
  p.width_px = 510;
  p.height_px = 240;
  p.y_from_zero = true;
  double end = 0.0;
  for (const OperatingPoint& o : points) end = std::max(end, std::isfinite(x.value(o)) ? x.value(o) : 0.0);
  p.x_min = 0.0;
  p.x_max = 1.03 * end;
  if (f.unit == "N") p.right = render::RightScale{"g", 1000.0 / kGravity_m_s2};
  for (const Ordinate& y : f.of)
    if (any(points, y.value)) add(p, points, levels, x, y, f.of.size() == 1);
  return p.series.empty() ? "" : render::figure_html(p.title, render::plot_svg(p));
}

const std::vector<OperatingFigure>& figures() {
  static const std::vector<OperatingFigure> all{
      {"thrust", "N", {{"thrust", [](const OperatingPoint& p) { return p.thrust_N; }, 2}}},
      {"supply current", "A", {{"current", [](const OperatingPoint& p) { return p.current_A; }, 0}}},
      {"power",
       "W",
       {{"electrical, from the supply", [](const OperatingPoint& p) { return p.electrical_W(); }, 0},
        {"of the shaft", [](const OperatingPoint& p) { return p.shaft_W(); }, 3}}},
      {"thrust per electrical power", "g/W", {{"g/W", [](const OperatingPoint& p) { return p.grams_per_watt(); }, 2}}},
      {"thrust per supply current", "N/A", {{"N/A", [](const OperatingPoint& p) { return p.newtons_per_ampere(); }, 2}}},
      {"efficiency of motor and ESC", "%", {{"efficiency", [](const OperatingPoint& p) { return 100.0 * p.drive_efficiency(); }, 3}}},
  };
  return all;
}

}  // namespace

std::string operating_figures(const StandEstimate& e) {
  const OperatingPoints& points = e.points;
  if (!any(points, [](const OperatingPoint& p) { return p.thrust_N; })) return "";
  const OperatingPoints levels = levels_of(points);
  const Abscissa speed{"speed", "rotor speed, RPM", [](const OperatingPoint& p) { return p.omega_rad_s * kRpm_per_rad_s; }};
  const Abscissa voltage{"voltage", "voltage of the motor, amplitude between two lines, V",
                         [](const OperatingPoint& p) { return p.motor_V; }};
  std::string out = "<h3>Operating points over rotor speed</h3>\n<div class=\"two\">\n";
  for (const OperatingFigure& f : figures()) out += figure(f, points, levels, speed);
  out += "</div>\n";
  if (!any(points, voltage.value))
    return out +
           "<p class=\"cap\">Not drawn over voltage: the file has no modulation of the ESC (duty 0 to 1), so that what of the supply "
           "reached the motor is not known.</p>\n";
  out +=
      "<h3>Operating points over voltage</h3>\n<p class=\"cap\">Each point needs at least this supply: a battery of 14 V under load ends "
      "where the curves reach 14 V, less what the ESC keeps for itself.</p>\n<div class=\"two\">\n";
  for (const OperatingFigure& f : figures()) out += figure(f, points, levels, voltage);
  return out + "</div>\n";
}

}  // namespace rotorloop::stand
