#include "bench/render/svg_pieces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace rotorloop::render {
namespace {
constexpr double kGlyph_px = 6.3;  // mean width of a character at the font size of the style sheet
}  // namespace

std::string xml_escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') out += c;
    }
  }
  return out;
}

Ticks nice_ticks(double low, double high, int wanted) {
  const double raw = (high - low) / std::max(1, wanted);
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double m : {1.0, 2.0, 5.0})
    if (m * power >= raw * 0.999) {
      step = m * power;
      break;
    }
  Ticks t;
  t.decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) t.at.push_back(k * step);
  return t;
}

Ticks decade_ticks(double low, double high, int wanted) {
  Ticks t;
  t.decades = true;
  const bool finer = 3.0 * (high - low) <= wanted;
  const double every = finer ? 1.0 : std::max(1.0, std::ceil((high - low) / std::max(1, wanted)));
  for (double k = std::floor(low / every) * every; k <= high; k += every) {
    for (const double m : {1.0, 2.0, 5.0}) {
      const double at = k + std::log10(m);
      if ((m == 1.0 || finer) && at >= low - 1e-9 && at <= high + 1e-9) t.at.push_back(at);
    }
  }
  return t;
}

std::string tick_text(double at, const Ticks& ticks) {
  if (!ticks.decades) return tick_text(at, ticks.decimals);
  const double power = std::floor(at + 1e-9), first = std::round(std::pow(10.0, at - power));
  constexpr double kPlain = 4.0;  // powers of ten that are written out
  if (std::fabs(power) <= kPlain) return fmt::format("{:g}", first * std::pow(10.0, power));
  constexpr const char* kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string out = first == 1.0 ? "10" : fmt::format("{:g}·10", first);
  for (const char c : fmt::format("{:.0f}", power)) out += c == '-' ? "⁻" : kDigits[c - '0'];
  return out;
}

double text_px(std::string_view text) {
  double n = 0;
  for (const char c : text) n += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  return n * kGlyph_px;
}

std::string px(double v) {
  const double tenth = std::round(v * 10) / 10;
  return tenth == std::floor(tenth) ? fmt::format("{:.0f}", tenth == 0 ? 0.0 : tenth) : fmt::format("{:.1f}", tenth);
}

std::string tick_text(double v, int decimals) {
  auto text = fmt::format("{:.{}f}", v, decimals);
  if (text.starts_with('-') && text.find_first_not_of("-0.") == std::string::npos) text.erase(0, 1);
  if (text.starts_with('-')) text.replace(0, 1, "−");
  return text;
}

std::string open_svg(int width, double height, const std::string& title) {
  return fmt::format("<svg class=\"plot\" viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" role=\"img\" aria-label=\"{}\">\n", width,
                     px(height), width, px(height), xml_escaped(title));
}

}  // namespace rotorloop::render
