#include "bench/render/svg_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "bench/render/svg_axes.hpp"

namespace rotorloop::render {
namespace {

constexpr double kBucket_px = 1.5;  // a lowest and a highest point this far apart draw the same line as all points

bool ascending(const std::vector<double>& x) {
  double last = -HUGE_VAL;
  for (const double v : x) {
    if (std::isnan(v)) continue;
    if (v < last) return false;
    last = v;
  }
  return true;
}

std::string path_of(const Series& s, const PlotArea& f) {
  std::vector<double> xs, ys;
  if (ascending(s.x))
    decimate_min_max(s.x, s.y, f.x.low, f.x.high, static_cast<int>((f.right - f.left) / kBucket_px), xs, ys);
  else {
    xs = s.x;
    ys = s.y;
  }
  std::string d;
  bool pen_down = false;
  double px_x = 0, px_y = 0;
  for (std::size_t i = 0; i < xs.size(); ++i) {
    if (!std::isfinite(xs[i]) || !std::isfinite(ys[i])) {
      pen_down = false;
      continue;
    }
    const double x = f.at_x(xs[i]), y = f.at_y(ys[i]);
    if (!pen_down) {
      d += fmt::format("M{} {}", px(x), px(y));
    } else {
      const bool last = i + 1 == xs.size() || !std::isfinite(xs[i + 1]) || !std::isfinite(ys[i + 1]);
      if (!s.stepped && !last && std::fabs(x - px_x) + std::fabs(y - px_y) < 0.5) continue;  // invisible
      d += s.stepped ? fmt::format("H{}V{}", px(x), px(y)) : fmt::format("L{} {}", px(x), px(y));
    }
    pen_down = true;
    px_x = x;
    px_y = y;
  }
  return d;
}

// Dots are strokes without length, rounded at both ends; rings are two half circles.
constexpr double kDot_px = 5.0, kRing_px = 2.4;
std::string marker_svg(Marker marker, int colour, const std::string& path) {
  return fmt::format("<path class=\"ln c{}\" stroke-width=\"{}\" d=\"{}\"/>", css_colour(colour), marker == Marker::dot ? kDot_px : 1.2,
                     path);
}
std::string marker_at(Marker marker, double x, double y) {
  if (marker == Marker::dot) return fmt::format("M{} {}h0", px(x), px(y));
  return fmt::format("M{0} {1}a{2} {2} 0 1 0 {3} 0a{2} {2} 0 1 0 -{3} 0", px(x - kRing_px), px(y), kRing_px, 2 * kRing_px);
}
std::string markers_of(const Series& s, const PlotArea& f) {
  std::string d;
  for (std::size_t i = 0; i < std::min(s.x.size(), s.y.size()); ++i)
    if (std::isfinite(s.x[i]) && std::isfinite(s.y[i])) d += marker_at(s.marker, f.at_x(s.x[i]), f.at_y(s.y[i]));
  return marker_svg(s.marker, s.colour, d);
}

// Grows the tighter axis until one unit is equally long on both.
void equalise(PlotArea& f) {
  const double scale = std::min((f.right - f.left) / f.x.size(), (f.bottom - f.top) / f.y.size());
  const auto grow = [&](DataSpan& s, double pixels) {
    const double middle = (s.low + s.high) / 2, half = pixels / scale / 2;
    s = {middle - half, middle + half};
  };
  grow(f.x, f.right - f.left);
  grow(f.y, f.bottom - f.top);
}

// The same with logarithms in place of the numbers.
Plot in_decades(Plot p) {
  const auto log_of = [](double v) { return v > 0.0 ? std::log10(v) : std::nan(""); };
  const auto all = [&](std::vector<double>& numbers) {
    for (double& v : numbers) v = log_of(v);
  };
  const auto bound = [&](std::optional<double>& v) {
    if (v) v = *v > 0.0 ? std::optional(log_of(*v)) : std::nullopt;
  };
  if (p.log_x) {
    for (Series& s : p.series) all(s.x);
    for (Band& b : p.bands) {
      b.from = log_of(b.from);
      b.to = log_of(b.to);
    }
    for (auto* v : {&p.x_min, &p.x_max, &p.fit_from, &p.fit_to}) bound(*v);
  }
  if (p.log_y) {
    for (Series& s : p.series) all(s.y);
    std::erase_if(p.marks, [](const HorizontalMark& m) { return m.y <= 0.0; });
    for (HorizontalMark& m : p.marks) m.y = log_of(m.y);
    for (auto* v : {&p.y_min, &p.y_max}) bound(*v);
  }
  return p;
}

}  // namespace

void decimate_min_max(const std::vector<double>& x, const std::vector<double>& y, double x_min, double x_max, int buckets,
                      std::vector<double>& x_out, std::vector<double>& y_out) {
  x_out.clear();
  y_out.clear();
  const std::size_t n = std::min(x.size(), y.size());
  const double per_unit = buckets / (x_max - x_min);
  const auto bucket = [&](std::size_t i) { return std::floor((x[i] - x_min) * per_unit); };
  const auto put = [&](std::size_t i) {
    x_out.push_back(x[i]);
    y_out.push_back(y[i]);
  };
  for (std::size_t i = 0; i < n;) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i])) {
      if (!x_out.empty() && !std::isnan(y_out.back())) {
        x_out.push_back(x[i]);
        y_out.push_back(std::nan(""));
      }
      ++i;
      continue;
    }
    // One bucket: first, lowest, highest and last of its run of good points, in order.
    const double b = bucket(i);
    std::size_t end = i, low = i, high = i;
    for (; end < n && std::isfinite(x[end]) && std::isfinite(y[end]) && bucket(end) == b; ++end) {
      if (y[end] < y[low]) low = end;
      if (y[end] > y[high]) high = end;
    }
    std::array<std::size_t, 4> keep{i, std::min(low, high), std::max(low, high), end - 1};
    if (b >= 0 && b <= buckets)
      for (std::size_t k = 0; k < keep.size(); ++k)
        if (k == 0 || keep[k] != keep[k - 1]) put(keep[k]);
    i = end;
  }
}

namespace {

std::vector<LegendItem> legend_of(const Plot& p) {
  std::vector<LegendItem> legend;
  for (const auto& s : p.series)
    if (!s.label.empty() && s.marker != Marker::none)
      legend.push_back({s.label, marker_svg(s.marker, s.colour, marker_at(s.marker, 11, 0))});
    else if (!s.label.empty())
      legend.push_back({s.label, fmt::format("<path class=\"ln c{}\" d=\"M0 0H22\" stroke-width=\"{}\"{}/>", css_colour(s.colour),
                                             s.width_px + 0.5, s.dashed ? " stroke-dasharray=\"5 4\"" : "")});
  std::set<std::string> banded;
  for (const auto& b : p.bands)
    if (b.colour >= 0 && banded.insert(b.label).second)
      legend.push_back(
          {b.label, fmt::format("<rect class=\"bd g{}\" x=\"2\" y=\"-6\" width=\"20\" height=\"12\"/>", css_colour(b.colour))});
  return legend;
}

// What the axes span: the data with some room, unless the plot says otherwise.
void find_spans(const Plot& p, DataSpan& x, DataSpan& y) {
  for (const auto& s : p.series)
    for (std::size_t i = 0; i < std::min(s.x.size(), s.y.size()); ++i) {
      if (!std::isfinite(s.y[i]) || !std::isfinite(s.x[i])) continue;
      x.add(s.x[i]);
      const bool shown = (!p.x_min || s.x[i] >= *p.x_min) && (!p.x_max || s.x[i] <= *p.x_max);
      const bool fitted = (!p.fit_from || s.x[i] >= *p.fit_from) && (!p.fit_to || s.x[i] <= *p.fit_to);
      if (shown && fitted) y.add(s.y[i]);
    }
  for (const auto& m : p.marks) y.add(m.y);
  if (p.y_from_zero) y.add(0.0);
  x = drawable(x);
  y = drawable(y);
  for (DataSpan* span : {&x, &y}) {
    const double lack = p.min_extent - span->size();
    if (lack > 0) *span = {span->low - lack / 2, span->high + lack / 2};
  }
  const double room = 0.05 * y.size();
  if (!(p.y_from_zero && y.low == 0)) y.low -= room;
  y.high += room;
  if (p.equal_axes) {
    x.low -= 0.04 * x.size();
    x.high += 0.04 * x.size();
  }
  if (p.x_min) x.low = *p.x_min;
  if (p.x_max) x.high = *p.x_max;
  if (p.y_min) y.low = *p.y_min;
  if (p.y_max) y.high = *p.y_max;
  x = drawable(x);
  y = drawable(y);
}

struct PlotFrame {
  PlotArea f;
  Ticks x_ticks, y_ticks, right_ticks;
  bool slanted = false;   // names in place of numbers on the x axis
  double names_px = 0.0;  // height that they take
};

PlotFrame lay_out(const Plot& p, double legend_height) {
  DataSpan x, y;
  find_spans(p, x, y);
  PlotFrame out{};
  double longest_name = 0;
  for (const auto& name : p.x_names) longest_name = std::max(longest_name, text_px(name));
  out.slanted = longest_name > 0.8 * (p.width_px - 80.0) / static_cast<double>(std::max<std::size_t>(1, p.x_names.size()));
  out.names_px = out.slanted ? kSlantSine * longest_name : 0.0;
  PlotArea& f = out.f;
  f = {.left = 0, .top = legend_height + 8, .right = p.width_px - 12.0, .bottom = p.height_px - 42.0 - out.names_px, .x = x, .y = y};
  const int y_wanted = std::max(2, static_cast<int>((f.bottom - f.top) / 42));
  // One tick shows no scale: try for more until there are three, as far as there is room.
  const auto three_ticks = [&](double low, double high) {
    Ticks t = nice_ticks(low, high, y_wanted);
    for (int more = 1; more <= 3 && t.at.size() < 3; ++more) t = nice_ticks(low, high, y_wanted + more);
    return t;
  };
  const auto y_ticks_of = [&](const auto& range) {
    return p.log_y ? decade_ticks(range.low, range.high, y_wanted) : three_ticks(range.low, range.high);
  };
  f.left = 36 + tick_width(y_ticks_of(y));
  if (p.right) {
    out.right_ticks = three_ticks(p.right->per_y * y.low, p.right->per_y * y.high);
    f.right = p.width_px - 36.0 - tick_width(out.right_ticks);
  }
  if (p.width_px > 900) f.left = std::max(f.left, 62.0);  // plots below each other share their time axis
  if (p.equal_axes) equalise(f);
  out.y_ticks = y_ticks_of(f.y);
  const int x_wanted = std::max(2, static_cast<int>((f.right - f.left) / (p.equal_axes ? 55 : 90)));
  out.x_ticks = p.log_x ? decade_ticks(f.x.low, f.x.high, x_wanted) : nice_ticks(f.x.low, f.x.high, x_wanted);
  if (!p.log_x && out.x_ticks.at.size() < 3) out.x_ticks = nice_ticks(f.x.low, f.x.high, x_wanted + 2);
  return out;
}

std::string band_svg(const Band& b, const PlotArea& f) {
  const double from = f.at_x(std::clamp(b.from, f.x.low, f.x.high)), to = f.at_x(std::clamp(b.to, f.x.low, f.x.high));
  std::string out =
      fmt::format("<rect class=\"bd{}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>", b.colour < 0 ? "" : " g" + css_colour(b.colour),
                  px(from), px(f.top), px(std::max(1.0, to - from)), px(f.bottom - f.top));
  if (!b.label.empty() && b.colour < 0)
    out += fmt::format("<text class=\"tk\" x=\"{}\" y=\"{}\">{}</text>", px(from + 4), px(f.top + 13), xml_escaped(b.label));
  return out + '\n';
}

}  // namespace

std::string plot_svg(const Plot& given) {
  const Plot p = given.log_x || given.log_y ? in_decades(given) : given;
  const auto [legend_text, legend_height] = legend_svg(legend_of(p), 8, p.width_px);
  const PlotFrame frame = lay_out(p, legend_height);
  const PlotArea& f = frame.f;
  std::string out = open_svg(p.width_px, p.height_px, p.title);
  for (const auto& b : p.bands) out += band_svg(b, f);
  out += y_axis(f, frame.y_ticks, p.y_label);
  if (p.right) out += right_axis(f, frame.right_ticks, p.right->per_y, p.right->label, p.width_px - 13.0);
  out += p.x_names.empty() ? x_axis(f, frame.x_ticks, p.x_label)
                           : named_x_axis(f, p.x_names, frame.slanted, f.bottom + 34 + frame.names_px, p.x_label);
  out += legend_text;
  // A nested viewport clips what lies outside the axes.
  out += fmt::format("<svg x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\" viewBox=\"{0} {1} {2} {3}\">\n", px(f.left), px(f.top),
                     px(f.right - f.left), px(f.bottom - f.top));
  for (const auto& s : p.series)
    out += s.marker != Marker::none ? markers_of(s, f) + "\n"
                                    : fmt::format("<path class=\"ln c{}\" stroke-width=\"{}\"{} d=\"{}\"/>\n", css_colour(s.colour),
                                                  s.width_px, s.dashed ? " stroke-dasharray=\"5 4\"" : "", path_of(s, f));
  out += "</svg>\n";
  for (const auto& m : p.marks) {
    if (m.y < f.y.low || m.y > f.y.high) continue;
    out += fmt::format("<path class=\"mk\" d=\"M{} {}H{}\"/><text class=\"mt\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>\n",
                       px(f.left), px(f.at_y(m.y)), px(f.right), px(f.right - 4), px(f.at_y(m.y) - 5), xml_escaped(m.label));
  }
  return out + "</svg>\n";
}

std::string_view plot_css() {
  return R"(:root{--c0:#c8500a;--c1:#0067a5;--c2:#008a63;--c3:#b0578d;--c4:#b37f00;--c5:#2f9bd8;--ink:#1b2027;--soft:#5c6672;--line:#e3e7ec;--edge:#b9c1cb;--paper:#ffffff;--raise:#f6f8fa;--alarm:#b3261e;--good:#1a7f4b;--wait:#8a6100}
@media (prefers-color-scheme:dark){:root{--c0:#f08a4b;--c1:#63b3ee;--c2:#3ecfa0;--c3:#e39cc6;--c4:#e8bc4a;--c5:#8fd0f7;--ink:#e6eaf0;--soft:#9aa5b1;--line:#2a3038;--edge:#48515c;--paper:#14181d;--raise:#1b2027;--alarm:#ff8a80;--good:#5fd39a;--wait:#e8bc4a}}
.plot{display:block;max-width:100%;height:auto;font:11.5px/1.2 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,"DejaVu Sans",sans-serif;font-variant-numeric:tabular-nums}
.plot text{fill:var(--soft)}.plot .lb,.plot .lg{fill:var(--ink)}
.plot .gr{stroke:var(--line);fill:none;shape-rendering:crispEdges}.plot .ax{stroke:var(--edge);fill:none;shape-rendering:crispEdges}
.plot .ln{fill:none;stroke-linejoin:round;stroke-linecap:round}
.plot .cn{stroke:var(--ink);opacity:.75}.plot .c0{stroke:var(--c0)}.plot .c1{stroke:var(--c1)}.plot .c2{stroke:var(--c2)}.plot .c3{stroke:var(--c3)}.plot .c4{stroke:var(--c4)}.plot .c5{stroke:var(--c5)}
.plot .fn{fill:var(--soft)}.plot .f0{fill:var(--c0)}.plot .f1{fill:var(--c1)}.plot .f2{fill:var(--c2)}.plot .f3{fill:var(--c3)}.plot .f4{fill:var(--c4)}.plot .f5{fill:var(--c5)}
.plot rect[class^=f]{opacity:.55}.plot .bd{fill:var(--soft);opacity:.1}.plot .g0,.plot .g1,.plot .g2,.plot .g3,.plot .g4,.plot .g5{opacity:.2}
.plot .g0{fill:var(--c0)}.plot .g1{fill:var(--c1)}.plot .g2{fill:var(--c2)}.plot .g3{fill:var(--c3)}.plot .g4{fill:var(--c4)}.plot .g5{fill:var(--c5)}
.plot .mk{stroke:var(--alarm);stroke-dasharray:6 3;fill:none}.plot text.mt{fill:var(--alarm)}
.plot .zr{stroke:#fff;stroke-width:1.4;fill:none}.plot .rm{stroke:var(--edge);fill:none}.plot .wd{stroke:var(--ink);stroke-width:1.5;fill:none}.plot .hd{fill:var(--ink)}
.plot .wh{stroke:var(--ink);stroke-width:1.3;fill:none}.plot .pt{fill:var(--ink);opacity:.55}.plot .rf{fill:var(--paper);stroke:var(--ink);stroke-width:1.5}
)";
}

}  // namespace rotorloop::render
