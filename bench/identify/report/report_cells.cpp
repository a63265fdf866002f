#include "bench/identify/report/report_cells.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>

#include "bench/render/svg_pieces.hpp"

namespace rotorloop::identify {
namespace {
constexpr std::string_view kMinus = "−";
}

std::string num(double v, const char* format) {
  if (!std::isfinite(v)) return "–";
  std::string text = fmt::format(fmt::runtime(format), v);
  for (std::size_t at = text.find('-'); at != std::string::npos; at = text.find('-', at + kMinus.size())) text.replace(at, 1, kMinus);
  return text;
}
std::string two(double v) { return num(v, "{:.2g}"); }
std::string plus_minus(double u) { return u > 0.0 ? "± " + two(u) : ""; }
std::string p_text(double p) { return p < 1e-300 ? "< 1e−300" : two(p); }

std::string page_unit(const std::string& unit) {
  std::string out;
  for (std::size_t i = 0; i < unit.size(); ++i) {
    const bool power = i > 0 && std::isalpha(static_cast<unsigned char>(unit[i - 1])) && (unit[i] == '2' || unit[i] == '3');
    out += !power ? std::string(1, unit[i]) : unit[i] == '2' ? "²" : "³";
  }
  return out;
}

std::string with_true_minus(std::string text) {
  for (std::size_t at = 0; at + 1 < text.size(); ++at) {
    const bool opens = at == 0 || text[at - 1] == ' ' || text[at - 1] == '(';
    if (text[at] == '-' && opens && std::isdigit(static_cast<unsigned char>(text[at + 1]))) text.replace(at, 1, kMinus);
  }
  return text;
}

std::string cell(const std::string& text, const std::string& kind) {
  return (kind.empty() ? "<td>" : "<td class=\"" + kind + "\">") + text + "</td>";
}
std::string left_cell(const std::string& text, const std::string& kind) {
  return cell(render::xml_escaped(text), kind.empty() ? "l" : "l " + kind);
}

HeadCell left(std::string name) { return {std::move(name), true}; }

std::string head(const std::vector<HeadCell>& columns, const std::vector<HeadCell>& above) {
  const auto row = [](const std::vector<HeadCell>& names) {
    std::string out = "<tr>";
    for (const HeadCell& c : names)
      out += fmt::format("<th{}{}>{}</th>", c.left ? " class=\"l\"" : "", c.span > 1 ? fmt::format(" colspan=\"{}\"", c.span) : "",
                         render::xml_escaped(c.name));
    return out + "</tr>";
  };
  return "<div class=\"scroll\"><table><thead>" + (above.empty() ? "" : row(above)) + row(columns) + "</thead><tbody>\n";
}

}  // namespace rotorloop::identify
