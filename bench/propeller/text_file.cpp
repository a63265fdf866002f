#include "bench/propeller/text_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>

#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace {
constexpr std::string_view kBlanks = " \t\r\v\f";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

std::vector<std::string> split(std::string_view text) {
  std::vector<std::string> fields;
  for (std::size_t at = text.find_first_not_of(kBlanks); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kBlanks, at), text.size());
    fields.emplace_back(text.substr(at, end - at));
    at = text.find_first_not_of(kBlanks, end);
  }
  return fields;
}

std::string joined(std::initializer_list<Column> columns) {
  std::string out;
  for (const Column& c : columns) out += (out.empty() ? "" : " ") + std::string(c.name);
  return out;
}
}  // namespace

TextFile TextFile::read(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in && text.empty()) throw Error({path.generic_string(), "cannot be read", "no such file", "check the path and the data folder"});
  return parse(text, path);
}

TextFile TextFile::parse(std::string_view text, const std::filesystem::path& name_for_errors) {
  TextFile file{name_for_errors, {}};
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    line = line.substr(0, line.find_last_not_of(kBlanks) + 1);
    file.lines.push_back({static_cast<int>(file.lines.size()) + 1, std::string(line), split(line)});
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  bool any = false;
  for (const TextLine& l : file.lines) any = any || !l.fields.empty();
  if (!any) file.fail(1, "the file is empty", "a download that failed", "get the file again");
  return file;
}

void TextFile::fail(int line, const std::string& what, const std::string& likely, const std::string& remedy) const {
  throw Error({fmt::format("{}:{}", name.generic_string(), line), what, likely, remedy});
}

double TextFile::number(const TextLine& line, std::size_t column, std::string_view what, Range range) const {
  if (column >= line.fields.size())
    fail(line.number, fmt::format("{} is missing: the line has {} of {} fields", what, line.fields.size(), column + 1),
         "the file was cut off", "get the file again");
  const std::string& text = line.fields[column];
  double value = 0.0;
  const auto r = std::from_chars(text.data(), text.data() + text.size(), value);
  if (r.ec != std::errc{} || r.ptr != text.data() + text.size() || !std::isfinite(value))
    fail(line.number, fmt::format("{} = \"{}\" is not a finite number", what, text), "a damaged or edited row",
         "correct or remove the row");
  if (value < range.min || value > range.max)
    fail(
        line.number,
        fmt::format("{} = {} is outside {} to {} {}", what, number_text(value), number_text(range.min), number_text(range.max), range.unit),
        "another unit, or columns in another order", fmt::format("give {} in {}", what, range.unit == "1" ? "plain numbers" : range.unit));
  return value;
}

std::vector<TableRow> read_table(const TextFile& file, std::initializer_list<Column> columns, std::size_t min_rows) {
  auto line = file.lines.begin();
  while (line->fields.empty()) ++line;
  bool alike = line->fields.size() == columns.size();
  for (std::size_t i = 0; alike && i < columns.size(); ++i) alike = line->fields[i] == columns.begin()[i].name;
  if (!alike)
    file.fail(line->number, fmt::format("columns are \"{}\", expected \"{}\"", fmt::join(line->fields, " "), joined(columns)),
              "another kind of file, or columns added", "give exactly these columns, in this order, under this header");
  std::vector<TableRow> rows;
  for (++line; line != file.lines.end(); ++line) {
    if (line->fields.empty()) continue;
    if (line->fields.size() > columns.size())
      file.fail(line->number, fmt::format("{} fields where the header has {}", line->fields.size(), columns.size()),
                "two rows run together", "give one row a line");
    TableRow row{line->number, {}};
    for (std::size_t i = 0; i < columns.size(); ++i)
      row.values.push_back(file.number(*line, i, columns.begin()[i].name, columns.begin()[i].range));
    rows.push_back(std::move(row));
  }
  if (rows.size() < min_rows)
    file.fail(static_cast<int>(file.lines.size()), fmt::format("{} rows, expected at least {}", rows.size(), min_rows),
              "the file was cut off", "get the whole file");
  return rows;
}

}  // namespace rotorloop::propeller
