#include "bench/render/svg_axes.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace rotorloop::render {
namespace {

constexpr double kLegendRow_px = 22;

}  // namespace

DataSpan drawable(DataSpan s) {
  if (s.empty()) return {0, 1};
  if (s.size() <= 1e-12 * std::max(std::fabs(s.low), std::fabs(s.high)) || s.size() == 0) {
    const double around = s.low == 0 ? 1 : 0.1 * std::fabs(s.low);
    return {s.low - around, s.high + around};
  }
  return s;
}

std::string css_colour(int colour) { return colour < 0 ? "n" : std::to_string(colour % kPaletteSize); }

std::pair<std::string, double> legend_svg(const std::vector<LegendItem>& items, double left, double right) {
  if (items.empty()) return {"", 0};
  std::string out;
  double x = left, y = 12;
  for (const auto& item : items) {
    const double needed = 28 + text_px(item.label) + 18;
    if (x > left && x + needed > right) {
      x = left;
      y += kLegendRow_px - 4;
    }
    out += fmt::format("<g transform=\"translate({} {})\">{}<text class=\"lg\" x=\"28\" y=\"4\">{}</text></g>\n", px(x), px(y), item.swatch,
                       xml_escaped(item.label));
    x += needed;
  }
  return {out, y + kLegendRow_px - 12};
}

std::string x_axis(const PlotArea& f, const Ticks& ticks, const std::string& label) {
  std::string out;
  for (const double t : ticks.at) {
    const auto x = px(f.at_x(t));
    out += fmt::format("<path class=\"gr\" d=\"M{} {}V{}\"/><text class=\"tk\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", x,
                       px(f.top), px(f.bottom), x, px(f.bottom + 16), tick_text(t, ticks));
  }
  out += fmt::format("<path class=\"ax\" d=\"M{} {}H{}\"/><text class=\"lb\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
                     px(f.left), px(f.bottom), px(f.right), px((f.left + f.right) / 2), px(f.bottom + 34), xml_escaped(label));
  return out;
}

std::string named_x_axis(const PlotArea& f, const std::vector<std::string>& names, bool slanted, double label_y, const std::string& label) {
  std::string out;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double at = static_cast<double>(i + 1);
    if (at < f.x.low || at > f.x.high) continue;
    const auto x = px(f.at_x(at)), y = px(f.bottom + 16);
    out += fmt::format("<path class=\"gr\" d=\"M{} {}V{}\"/>", x, px(f.top), px(f.bottom));
    out += slanted
               ? fmt::format("<text class=\"tk\" x=\"{0}\" y=\"{1}\" text-anchor=\"end\" transform=\"rotate(-{2} {0} {1})\">{3}</text>\n",
                             x, y, kSlant_deg, xml_escaped(names[i]))
               : fmt::format("<text class=\"tk\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", x, y, xml_escaped(names[i]));
  }
  return out + fmt::format("<path class=\"ax\" d=\"M{} {}H{}\"/><text class=\"lb\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
                           px(f.left), px(f.bottom), px(f.right), px((f.left + f.right) / 2), px(label_y), xml_escaped(label));
}

std::string y_axis(const PlotArea& f, const Ticks& ticks, const std::string& label) {
  std::string out;
  for (const double t : ticks.at) {
    const double y = f.at_y(t);
    out += fmt::format("<path class=\"gr\" d=\"M{} {}H{}\"/><text class=\"tk\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>\n",
                       px(f.left), px(y), px(f.right), px(f.left - 7), px(y + 4), tick_text(t, ticks));
  }
  const double middle = (f.top + f.bottom) / 2;
  out += fmt::format("<text class=\"lb\" transform=\"translate(13 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n", px(middle),
                     xml_escaped(label));
  return out;
}

std::string right_axis(const PlotArea& f, const Ticks& ticks, double per_y, const std::string& label, double label_x) {
  std::string out;
  for (const double t : ticks.at) {
    const double y = f.at_y(t / per_y);
    out += fmt::format("<path class=\"ax\" d=\"M{} {}h4\"/><text class=\"tk\" x=\"{}\" y=\"{}\">{}</text>\n", px(f.right), px(y),
                       px(f.right + 7), px(y + 4), tick_text(t, ticks));
  }
  return out + fmt::format("<text class=\"lb\" transform=\"translate({} {}) rotate(90)\" text-anchor=\"middle\">{}</text>\n", px(label_x),
                           px((f.top + f.bottom) / 2), xml_escaped(label));
}

double tick_width(const Ticks& ticks) {
  double widest = 0;
  for (const double t : ticks.at) widest = std::max(widest, text_px(tick_text(t, ticks)));
  return widest;
}

}  // namespace rotorloop::render
