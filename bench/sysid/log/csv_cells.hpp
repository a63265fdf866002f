// Lines, cells and numbers of a CSV file, as spreadsheets and measuring programs write them.
#pragma once
#include <charconv>
#include <cstddef>
#include <limits>
#include <optional>
#include <string_view>

namespace rotorloop::log {

inline constexpr double kBlankCell = std::numeric_limits<double>::quiet_NaN();

struct CsvLines {
  std::string_view rest;
  std::size_t number = 0;
  bool ended = false;          // the line had its line feed
  bool with_comments = false;  // they come too

  // Next line that is not blank and, unless wanted, no comment.
  std::optional<std::string_view> next() {
    while (!rest.empty()) {
      const auto end = rest.find('\n');
      auto line = rest.substr(0, end);
      ended = end != std::string_view::npos;
      rest.remove_prefix(ended ? end + 1 : rest.size());
      ++number;
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      if (!line.empty() && (with_comments || line.front() != '#')) return line;
    }
    return std::nullopt;
  }
};

// Without blanks and quotes around it.
inline std::string_view csv_cell(std::string_view s) {
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
  while (!s.empty() && (s.back() == ' ' || s.back() == '\t' || s.back() == '\r')) s.remove_suffix(1);
  if (s.size() >= 2 && s.front() == '"' && s.back() == '"') s = s.substr(1, s.size() - 2);
  return s;
}

// Where the cell at the start of `line` ends: a separator between quotes is a part of it.
inline std::size_t csv_cell_end(std::string_view line, char separator) {
  const auto plain = line.find(separator), open = line.find_first_not_of(" \t");
  if (open == std::string_view::npos || line[open] != '"') return plain;
  for (auto quote = line.find('"', open + 1); quote != std::string_view::npos; quote = line.find('"', quote + 1)) {
    const auto after = line.find_first_not_of(" ", quote + 1);
    if (after == std::string_view::npos || line[after] == separator) return after;
    if (line[quote + 1] == '"') ++quote;  // a quote that is written twice stands for itself
  }
  return plain;
}

// Calls cell(index, text) for each cell; returns their number.
template <class Cell>
std::size_t split_csv(std::string_view line, char separator, const Cell& cell) {
  std::size_t i = 0;
  for (;; ++i) {
    const auto end = csv_cell_end(line, separator);
    cell(i, line.substr(0, end));
    if (end == std::string_view::npos) return i + 1;
    line.remove_prefix(end + 1);
  }
}

// Of a cell without blanks and quotes; not-a-number where there is none ("", "nan", "null", 1e999), nothing for any other text.
std::optional<double> csv_number(std::string_view text);

// The same where decimals may have a comma. Where cells are separated by commas too, "1,234" between quotes may be a thousand and more:
// taken for decimals only where it cannot be, with other than three digits behind the comma or nothing but a zero before it.
std::optional<double> csv_number_with_comma(std::string_view text, char separator);

}  // namespace rotorloop::log
