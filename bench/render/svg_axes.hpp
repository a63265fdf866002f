// Where the data of a plot are drawn, and what stands around them: axes with ticks and names, and the legend.
#pragma once
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "bench/render/svg_pieces.hpp"

namespace rotorloop::render {

struct DataSpan {
  double low = HUGE_VAL, high = -HUGE_VAL;
  void add(double v) {
    if (!std::isfinite(v)) return;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  bool empty() const { return !(low <= high); }
  double size() const { return high - low; }
};

// A range that can be drawn: never empty, never a point.
DataSpan drawable(DataSpan s);

// The rectangle that data are drawn in, and the map from data to pixels.
struct PlotArea {
  double left = 0, top = 0, right = 0, bottom = 0;
  DataSpan x, y;
  double at_x(double v) const { return left + (v - x.low) / x.size() * (right - left); }
  double at_y(double v) const { return bottom - (v - y.low) / y.size() * (bottom - top); }
};

struct LegendItem {
  std::string label, swatch;  // swatch: SVG drawn around (0, 0), 22 px wide
};

// A row of swatches with labels; wraps. Returns the SVG and the height used.
std::pair<std::string, double> legend_svg(const std::vector<LegendItem>& items, double left, double right);

std::string x_axis(const PlotArea& f, const Ticks& ticks, const std::string& label);
// Names of things at x = 1, 2, …; slanted ones end at their tick.
constexpr double kSlant_deg = 35.0, kSlantSine = 0.574;
std::string named_x_axis(const PlotArea& f, const std::vector<std::string>& names, bool slanted, double label_y, const std::string& label);
std::string y_axis(const PlotArea& f, const Ticks& ticks, const std::string& label);
// Ticks of a second scale of the y axis, round in its own unit; without grid lines, which are the first scale's.
std::string right_axis(const PlotArea& f, const Ticks& ticks, double per_y, const std::string& label, double label_x);
double tick_width(const Ticks& ticks);

std::string css_colour(int colour);  // the part of a class name that says the colour

}  // namespace rotorloop::render
