#include "bench/render/document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "bench/render/digits.hpp"
#include "bench/render/svg_pieces.hpp"

namespace rotorloop::render {
namespace {

constexpr std::string_view kMinus = "−";

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) text.replace(at, from.size(), to);
}

// Columns of a terminal count characters, not bytes.
std::size_t characters(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}
// A terminal's minus is that which other programs read.
std::string plain(std::string text) {
  replace_all(text, kMinus, "-");
  return text;
}

std::string typeset(std::string figure) {
  replace_all(figure, "-", kMinus);
  return figure;
}

std::string escaped(const std::string& text) { return xml_escaped(true_minus(text)); }

std::string head_html(const std::vector<Column>& columns) {
  std::string out = "<tr>";
  for (const Column& c : columns)
    out += fmt::format("<th{}{}>{}</th>", c.left ? " class=\"l\"" : "", c.span > 1 ? fmt::format(" colspan=\"{}\"", c.span) : "",
                       xml_escaped(c.title));
  return out + "</tr>";
}

std::string html(const Table& t) {
  std::string out =
      "<div class=\"scroll\"><table><thead>" + (t.above.empty() ? "" : head_html(t.above)) + head_html(t.columns) + "</thead><tbody>\n";
  for (const Row& row : t.rows) {
    out += row.first ? "<tr class=\"first\">" : "<tr>";
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      const std::string kind =
          std::string(t.columns[i].left ? "l" : "") + (t.columns[i].left && !row.cells[i].kind.empty() ? " " : "") + row.cells[i].kind;
      std::string text = escaped(row.cells[i].text);
      replace_all(text, "\n", "<br>");
      out += (kind.empty() ? "<td>" : "<td class=\"" + kind + "\">") + text + "</td>";
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}
std::string html(const Paragraph& p) { return p.on == On::terminal ? "" : "<p>" + escaped(p.text) + "</p>\n"; }
std::string html(const List& l) {
  std::string out = l.kind.empty() ? "<ul>\n" : "<ul class=\"" + l.kind + "\">\n";
  for (const std::string& item : l.items) out += "<li>" + escaped(item) + "</li>\n";
  return l.items.empty() ? "" : out + "</ul>\n";
}
std::string html(const Markup& m) { return m.html; }

// Widths of the columns by what stands in them; a cell of several lines goes on below itself.
std::string text(const Table& t) {
  std::vector<std::vector<std::string>> lines;
  const auto add = [&](const auto& cells, auto&& word) {
    std::vector<std::string> rest;
    for (const auto& c : cells) rest.push_back(plain(word(c)));
    while (std::any_of(rest.begin(), rest.end(), [](const std::string& s) { return !s.empty(); })) {
      lines.emplace_back();
      for (std::string& s : rest) {
        const std::size_t end = s.find('\n');
        lines.back().push_back(s.substr(0, end));
        s = end == std::string::npos ? "" : s.substr(end + 1);
      }
    }
  };
  std::vector<Column> above;
  for (const Column& c : t.above) {
    above.push_back(c);
    above.insert(above.end(), static_cast<std::size_t>(c.span - 1), left(""));
  }
  add(above, [](const Column& c) { return c.title; });
  add(t.columns, [](const Column& c) { return c.title; });
  const std::size_t heads = lines.size();
  for (const Row& row : t.rows) add(row.cells, [](const Cell& c) { return c.text; });
  std::vector<std::size_t> width(t.columns.size());
  for (std::size_t l = above.empty() ? 0 : 1; l < lines.size(); ++l) {
    for (std::size_t i = 0; i < lines[l].size(); ++i) width[i] = std::max(width[i], characters(lines[l][i]));
  }
  std::string out;
  for (std::size_t l = 0; l < lines.size(); ++l) {
    std::string line;
    for (std::size_t i = 0; i < lines[l].size(); ++i) {
      const std::string& s = lines[l][i];
      const std::string gap(width[i] > characters(s) ? width[i] - characters(s) : 0, ' ');
      line += "  " + (t.columns[i].left || (l == 0 && heads > 1 && !above.empty()) ? s + gap : gap + s);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}
std::string text(const Paragraph& p) { return p.on == On::page ? "" : plain(p.text) + "\n"; }
std::string text(const List& l) {
  std::string out;
  for (const std::string& item : l.items) out += "  - " + plain(item) + "\n";
  return out;
}
std::string text(const Markup&) { return {}; }

}  // namespace

std::string figure_text(double value, const char* format) {
  if (!std::isfinite(value)) return std::isinf(value) ? std::string(value < 0.0 ? kMinus : "") + "∞" : "–";
  return typeset(fmt::format(fmt::runtime(format), value));
}
std::string measured_figure(double value, double u) {
  return std::isfinite(value) ? typeset(measured(value, u).value) : figure_text(value);
}
std::string measured_u(double u) { return u > 0.0 && std::isfinite(u) ? typeset(measured(0.0, u).u) : figure_text(u); }
std::string uncertainty_text(double u) { return u > 0.0 && std::isfinite(u) ? "± " + measured_u(u) : ""; }
std::string value_text(double value, double u, const std::string& unit) {
  const std::string in = unit_text(unit);
  const std::string after = uncertainty_text(u);
  return measured_figure(value, u) + (after.empty() ? "" : " " + after) + (in.empty() ? "" : " " + in);
}

std::string unit_text(const std::string& unit) {
  if (unit == "1") return {};
  std::string out;
  for (std::size_t i = 0; i < unit.size(); ++i) {
    const bool power = i > 0 && std::isalpha(static_cast<unsigned char>(unit[i - 1])) && (unit[i] == '2' || unit[i] == '3');
    out += !power ? std::string(1, unit[i]) : unit[i] == '2' ? "²" : "³";
  }
  return out;
}

std::string true_minus(std::string text) {
  for (std::size_t at = 0; at + 1 < text.size(); ++at) {
    const bool opens = at == 0 || text[at - 1] == ' ' || text[at - 1] == '(';
    if (text[at] == '-' && opens && std::isdigit(static_cast<unsigned char>(text[at + 1]))) text.replace(at, 1, kMinus);
  }
  return text;
}

std::string page_html(const Sections& sections) {
  std::string out;
  for (const Section& s : sections) {
    if (!s.title.empty())
      out += s.id.empty() ? "<h3>" + xml_escaped(s.title) + "</h3>\n" : "<h2 id=\"" + s.id + "\">" + xml_escaped(s.title) + "</h2>\n";
    for (const Block& b : s.blocks) out += std::visit([](const auto& block) { return html(block); }, b);
  }
  return out;
}

std::string terminal_text(const Sections& sections) {
  std::string out;
  for (const Section& s : sections) {
    std::string body;
    for (const Block& b : s.blocks) body += std::visit([](const auto& block) { return text(block); }, b);
    if (body.empty()) continue;
    out += (out.empty() ? "" : "\n") + (s.title.empty() ? "" : s.title + "\n") + body;
  }
  return out;
}

}  // namespace rotorloop::render
