// A report as a tree of sections with paragraphs, lists, tables and drawings, whose figures are typeset once: terminal and page are two
// ways to print the same tree.
#pragma once
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace rotorloop::render {

// Figures as print has them: a true minus; "–" for what is no number.
std::string figure_text(double value, const char* format = "{:.4g}");
std::string measured_figure(double value, double u);                      // the value with the digits that u allows (digits.hpp)
std::string measured_u(double u);                                         // "0.012", of two digits; "0" and "–" as figures have them
std::string uncertainty_text(double u);                                   // "± 0.012", of two digits; nothing when u is not above 0
std::string value_text(double value, double u, const std::string& unit);  // "5.10 ± 0.23 N": the digits that u allows (digits.hpp)
std::string unit_text(const std::string& unit);                           // "kg m2" as "kg m²"; "1" as nothing
std::string true_minus(std::string text);                                 // ASCII minus before a number; hyphens in words stay

struct Column {
  std::string title;
  bool left = false;
  int span = 1;  // columns below it, in the row above
};
inline Column left(std::string title, int span = 1) { return {std::move(title), true, span}; }

struct Cell {
  std::string text;
  std::string kind = {};  // "big", "pass", "fail": classes of the style sheet
  Cell(std::string plain, std::string of_kind = {}) : text(std::move(plain)), kind(std::move(of_kind)) {}
  Cell(const char* plain) : text(plain) {}
};
struct Row {
  std::vector<Cell> cells;  // one for each column
  bool first = false;       // of a group: ruled off above
};
struct Table {
  std::vector<Column> columns;
  std::vector<Row> rows = {};
  std::vector<Column> above = {};  // optional heads that span several columns
};
enum class On { both, page, terminal };
struct Paragraph {
  std::string text;
  On on = On::both;
};
struct List {
  std::vector<std::string> items;
  std::string kind = {};  // "warn": in a frame
};
// Markup for the page alone: a drawing.
struct Markup {
  std::string html;
};
using Block = std::variant<Paragraph, List, Table, Markup>;

struct Section {
  std::string title = {};  // empty: goes on without a head
  std::string id = {};     // of the page's anchor; empty: a head of the third order
  std::vector<Block> blocks = {};
};
using Sections = std::vector<Section>;

// Plain text throughout, escaped here.
std::string page_html(const Sections& sections);
std::string terminal_text(const Sections& sections);

}  // namespace rotorloop::render
