// Charts with one row per thing: bars, and a timeline.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/render/svg_axes.hpp"
#include "bench/render/svg_plot.hpp"

namespace rotorloop::render {
namespace {

constexpr double kBarRow_px = 34, kBar_px = 16;

std::string bar_svg(const Bar& b, const PlotArea& f, double y) {
  std::string out =
      fmt::format("<text class=\"lb\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>", px(f.left - 9), px(y + 4), xml_escaped(b.label));
  if (std::isfinite(b.value)) {
    const double end = f.at_x(b.value);
    out += fmt::format("<rect class=\"f{}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"2\"/>", css_colour(b.colour), px(f.left),
                       px(y - kBar_px / 2), px(std::max(0.5, end - f.left)), px(kBar_px));
    for (std::size_t i = 0; i < b.points.size() && b.points.size() > 1; ++i)
      if (std::isfinite(b.points[i]))  // spread over the bar's height so that equal values stay apart
        out += fmt::format("<circle class=\"pt\" cx=\"{}\" cy=\"{}\" r=\"2.2\"/>", px(f.at_x(b.points[i])),
                           px(y + (static_cast<double>((i * 7) % 10) - 4.5) * 1.3));
    if (b.spread && *b.spread > 0) {
      const double a = f.at_x(b.value - *b.spread), z = f.at_x(b.value + *b.spread);
      out += fmt::format("<path class=\"wh\" d=\"M{0} {2}H{1}M{0} {3}V{4}M{1} {3}V{4}\"/>", px(a), px(z), px(y), px(y - 5), px(y + 5));
    }
  } else {
    out += fmt::format("<text class=\"tk\" x=\"{}\" y=\"{}\">not measured</text>", px(f.left + 6), px(y + 4));
  }
  if (b.reference) {
    const double at = f.at_x(*b.reference);
    out += fmt::format("<path class=\"rf\" d=\"M{0} {1}L{2} {3}L{0} {4}L{5} {3}Z\"/>", px(at), px(y - 7), px(at + 6), px(y), px(y + 7),
                       px(at - 6));
  }
  return out + '\n';
}

}  // namespace

std::string bar_chart_svg(const BarChart& c) {
  DataSpan x;
  x.add(0.0);
  double label_width = 0;
  bool any_reference = false, any_points = false;
  for (const auto& b : c.bars) {
    x.add(b.value + b.spread.value_or(0));
    for (const double v : b.points) x.add(v);
    if (b.reference) {
      x.add(*b.reference);
      any_reference = true;
    }
    any_points = any_points || b.points.size() > 1;
    label_width = std::max(label_width, text_px(b.label));
  }
  if (c.limit) x.add(*c.limit);
  x = drawable(x);
  x.high += 0.12 * x.size();

  std::vector<LegendItem> legend;
  if (any_points) legend.push_back({"one seed", "<circle class=\"pt\" cx=\"11\" cy=\"0\" r=\"2.6\"/>"});
  if (any_points) legend.push_back({"± 1 standard deviation", "<path class=\"wh\" d=\"M2 0H20M2 -4V4M20 -4V4\"/>"});
  if (any_reference) legend.push_back({c.reference_label, "<path class=\"rf\" d=\"M11 -6L16 0L11 6L6 0Z\"/>"});
  if (c.limit) legend.push_back({c.limit_label, "<path class=\"mk\" d=\"M11 -8V8\"/>"});
  const auto [legend_text, legend_height] = legend_svg(legend, 8, c.width_px);

  const double top = legend_height + 6, bottom = top + kBarRow_px * static_cast<double>(c.bars.size());
  const PlotArea f{.left = label_width + 18, .top = top, .right = c.width_px - 14.0, .bottom = bottom, .x = x, .y = {0, 1}};
  std::string out = open_svg(c.width_px, bottom + 42, c.title) + legend_text;
  out += x_axis(f, nice_ticks(x.low, x.high, std::max(2, static_cast<int>((f.right - f.left) / 80))), c.x_label);
  double y = top + kBarRow_px / 2;
  for (const auto& b : c.bars) {
    out += bar_svg(b, f, y);
    y += kBarRow_px;
  }
  if (c.limit) out += fmt::format("<path class=\"mk\" d=\"M{} {}V{}\"/>\n", px(f.at_x(*c.limit)), px(f.top), px(f.bottom));
  out += fmt::format("<path class=\"ax\" d=\"M{} {}V{}\"/>\n", px(f.left), px(f.top), px(f.bottom));
  return out + "</svg>\n";
}

std::string timeline_svg(const Timeline& t) {
  constexpr double kRow_px = 22;
  double label_width = 0;
  for (const auto& r : t.rows) label_width = std::max(label_width, text_px(r.label));
  const DataSpan x = drawable({t.x_min, t.x_max});
  const PlotArea f{.left = label_width + 18,
                   .top = 6,
                   .right = t.width_px - 12.0,
                   .bottom = 6 + kRow_px * static_cast<double>(t.rows.size()),
                   .x = x,
                   .y = {0, 1}};
  std::string out = open_svg(t.width_px, f.bottom + 42, t.title);
  out += x_axis(f, nice_ticks(x.low, x.high, std::max(2, static_cast<int>((f.right - f.left) / 90))), t.x_label);
  double y = f.top;
  for (const auto& r : t.rows) {
    out += fmt::format("<text class=\"lb\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text><path class=\"gr\" d=\"M{} {}H{}\"/>",
                       px(f.left - 9), px(y + kRow_px / 2 + 4), xml_escaped(r.label), px(f.left), px(y + kRow_px), px(f.right));
    // Intervals closer than half a pixel are drawn as one: what is seen is the same, the file stays small.
    double from = 0, to = -1;
    std::string d;
    const auto put = [&] {
      if (to >= from)
        d += fmt::format("M{} {}h{}v{}h-{}z", px(from), px(y + 4), px(std::max(1.0, to - from)), px(kRow_px - 8),
                         px(std::max(1.0, to - from)));
    };
    for (const auto& i : r.intervals) {
      const double a = f.at_x(std::clamp(i.from, x.low, x.high)), b = f.at_x(std::clamp(i.to, x.low, x.high));
      if (to >= from && a - to < 0.5) {
        to = std::max(to, b);
        continue;
      }
      put();
      from = a;
      to = b;
    }
    put();
    if (!d.empty()) out += fmt::format("<path class=\"f{}\" d=\"{}\"/>", css_colour(r.colour), d);
    out += '\n';
    y += kRow_px;
  }
  return out + "</svg>\n";
}

}  // namespace rotorloop::render
