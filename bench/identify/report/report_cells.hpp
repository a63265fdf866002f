// Pieces of the identification report: numbers and units as print has them, cells, heads of tables.
#pragma once
#include <string>
#include <vector>

namespace rotorloop::identify {

std::string num(double v, const char* format = "{:.4g}");  // true minus; "–" for what is no number
std::string two(double v);                                 // two digits
std::string plus_minus(double u);                          // "± 0.012"; nothing when u is not above 0
std::string p_text(double p);                              // "< 1e−300" for what the number format cannot hold
std::string page_unit(const std::string& unit);            // "kg m2" as "kg m²"
// ASCII minus before a number as a true one; hyphens in words stay.
std::string with_true_minus(std::string text);

// `kind`: class of the style sheet: "l" left-aligned, "big", "fail" …
std::string cell(const std::string& text, const std::string& kind = "");
std::string left_cell(const std::string& text, const std::string& kind = "");  // escaped

struct HeadCell {
  std::string name;
  bool left = false;
  int span = 1;
  HeadCell(const char* text) : name(text) {}
  HeadCell(std::string text) : name(std::move(text)) {}
  HeadCell(std::string text, bool to_the_left, int columns = 1) : name(std::move(text)), left(to_the_left), span(columns) {}
};
HeadCell left(std::string name);
// `above`: an optional row of names that span several columns.
std::string head(const std::vector<HeadCell>& columns, const std::vector<HeadCell>& above = {});
inline constexpr const char* kTableEnd = "</tbody></table></div>\n";

}  // namespace rotorloop::identify
