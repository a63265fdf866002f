// Lines and numbers of the text files that propeller data come in, with one style of errors: every refusal names file, line,
// value, allowed range and remedy. Carriage returns, trailing blanks and a byte-order mark are forgiven; anything else is not.
#pragma once
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "host/base/toml_file.hpp"

namespace rotorloop::propeller {

struct TextLine {
  int number = 0;  // 1 is the first of the file
  std::string text;
  std::vector<std::string> fields;  // separated by blanks
};

struct TextFile {
  std::filesystem::path name;
  std::vector<TextLine> lines;  // empty ones too, so that line n is lines[n - 1]

  // Throw Error (ExitCode::usage) for a file that cannot be read or holds nothing.
  static TextFile read(const std::filesystem::path& path);
  static TextFile parse(std::string_view text, const std::filesystem::path& name_for_errors);

  [[noreturn]] void fail(int line, const std::string& what, const std::string& likely, const std::string& remedy) const;
  // Field `column` of a line as a finite number within `range`; `what` names it.
  double number(const TextLine& line, std::size_t column, std::string_view what, Range range) const;
};

// A table below one line of column names, as the UIUC database writes it: the names must be `columns`, in this order, each row
// must have as many finite numbers within their ranges. Returns the rows; at least `min_rows`, else the file counts as cut off.
struct Column {
  std::string_view name;
  Range range;
};
struct TableRow {
  int line = 0;
  std::vector<double> values;
};
std::vector<TableRow> read_table(const TextFile& file, std::initializer_list<Column> columns, std::size_t min_rows);

}  // namespace rotorloop::propeller
