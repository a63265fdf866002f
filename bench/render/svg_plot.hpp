// Plots as inline SVG: no dependency, the same bytes for the same data, printable, legible without scripts. Colours, fonts
// and dark mode come from the page's style sheet (plot_css()), so one plot suits both.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/render/svg_pieces.hpp"

namespace rotorloop::render {

enum class Marker { none, dot, ring };  // none: a line; else a point at each sample, not joined

struct Series {
  std::string label;         // empty: not in the legend
  std::vector<double> x, y;  // equal length; a gap where either is not-a-number
  int colour = 0;
  bool dashed = false;
  bool stepped = false;  // value holds until the next sample
  double width_px = 1.5;
  Marker marker = Marker::none;
};

struct HorizontalMark {
  double y = 0.0;
  std::string label;
};
// Shaded x interval behind the lines.
struct Band {
  double from = 0.0, to = 0.0;
  std::string label;
  int colour = kNeutral;  // kNeutral: grey, label in the band; else the label is in the legend, once for all bands that share it
};

// A second scale of the same values on the right: grams beside newtons.
struct RightScale {
  std::string label;
  double per_y = 1.0;  // value on the right for one of the y axis
};

struct Plot {
  std::string title;             // read out by screen readers; the caption of the figure is the page's
  std::string x_label, y_label;  // with units: "time, s"
  std::vector<Series> series;
  std::vector<HorizontalMark> marks;
  std::vector<Band> bands;
  int width_px = 1040, height_px = 260;
  std::vector<std::string> x_names = {};             // stand at x = 1, 2, … in place of numbers; slanted where they are long
  std::optional<double> x_min, x_max, y_min, y_max;  // else from the data
  std::optional<RightScale> right = {};              // not with log_y
  bool equal_axes = false;                           // one metre is as long in x as in y
  bool y_from_zero = false;
  bool log_x = false, log_y = false;       // decades; what is not above zero is left out; neither with equal_axes nor y_from_zero
  double min_extent = 0.0;                 // both axes span at least this: noise is not magnified to fill the plot
  std::optional<double> fit_from, fit_to;  // the y axis fits what lies between these x; peaks outside are cut off
};
std::string plot_svg(const Plot& plot);

// Horizontal bars, one per row: mean, spread as a whisker, single values as dots, a reference value as a mark.
struct Bar {
  std::string label;
  double value = 0.0;
  std::optional<double> spread;     // half length of the whisker
  std::vector<double> points;       // of each seed
  std::optional<double> reference;  // published figure
  int colour = 0;
};
struct BarChart {
  std::string title, x_label;
  std::vector<Bar> bars;
  std::string reference_label;  // "published"; in the legend when a bar has a reference
  std::optional<double> limit;  // vertical line
  std::string limit_label;
  int width_px = 1040;
};
std::string bar_chart_svg(const BarChart& chart);

// When something was active, one row per thing: filled intervals on a common time axis.
struct Interval {
  double from = 0.0, to = 0.0;
};
struct TimelineRow {
  std::string label;
  std::vector<Interval> intervals;
  int colour = 0;
};
struct Timeline {
  std::string title, x_label;
  std::vector<TimelineRow> rows;
  double x_min = 0.0, x_max = 1.0;
  int width_px = 1040;
};
std::string timeline_svg(const Timeline& timeline);

// Style rules that the plots of a page need, light and dark.
std::string_view plot_css();

// Thins a series with ascending x to the first, lowest, highest and last point of each of `buckets` equal spans of
// [x_min, x_max]: the drawn line keeps every peak. Gaps are kept.
void decimate_min_max(const std::vector<double>& x, const std::vector<double>& y, double x_min, double x_max, int buckets,
                      std::vector<double>& x_out, std::vector<double>& y_out);

}  // namespace rotorloop::render
