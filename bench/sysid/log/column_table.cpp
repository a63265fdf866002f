#include "bench/sysid/log/column_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <limits>
#include <optional>
#include <string_view>

#include "host/base/error.hpp"

namespace rotorloop::log {
namespace {

constexpr double kBlank = std::numeric_limits<double>::quiet_NaN();

[[noreturn]] void bad(const std::filesystem::path& path, std::size_t line, std::string what, std::string likely, std::string remedy) {
  throw Error({fmt::format("{}:{}", path.generic_string(), line), std::move(what), std::move(likely), std::move(remedy)},
              ExitCode::data_quality);
}

std::string_view trimmed(std::string_view s) {
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
  while (!s.empty() && (s.back() == ' ' || s.back() == '\t' || s.back() == '\r')) s.remove_suffix(1);
  if (s.size() >= 2 && s.front() == '"' && s.back() == '"') s = s.substr(1, s.size() - 2);
  return s;
}

// Calls cell(index, text) for each cell; returns their number.
template <class Cell>
std::size_t split(std::string_view line, char separator, const Cell& cell) {
  std::size_t i = 0;
  for (;; ++i) {
    const auto end = line.find(separator);
    cell(i, line.substr(0, end));
    if (end == std::string_view::npos) return i + 1;
    line.remove_prefix(end + 1);
  }
}

std::optional<double> number(std::string_view text) {
  if (text.empty() || text == "null" || text == "NULL" || text == "NA" || text == "None") return kBlank;
  if (text == "true" || text == "True") return 1.0;
  if (text == "false" || text == "False") return 0.0;
  if (text.front() == '+') text.remove_prefix(1);
  double v = 0.0;
  const auto [used, ec] = std::from_chars(text.data(), text.data() + text.size(), v);
  if (used != text.data() + text.size()) return std::nullopt;
  if (ec == std::errc::result_out_of_range) return kBlank;  // 1e999: no reading that anyone has taken
  if (ec != std::errc{}) return std::nullopt;
  return v - v == 0.0 ? v : kBlank;
}

struct Lines {
  std::string_view rest;
  std::size_t number = 0;
  bool ended = false;  // the line had its line feed

  // Next line that is neither blank nor a comment.
  std::optional<std::string_view> next() {
    while (!rest.empty()) {
      const auto end = rest.find('\n');
      auto line = rest.substr(0, end);
      ended = end != std::string_view::npos;
      rest.remove_prefix(ended ? end + 1 : rest.size());
      ++number;
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      if (!line.empty() && line.front() != '#') return line;
    }
    return std::nullopt;
  }
};

}  // namespace

std::string name_list(const std::vector<std::string>& names, std::size_t most) {
  if (names.empty()) return "(none)";
  std::string text =
      fmt::format("{}", fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(std::min(most, names.size())), ", "));
  if (names.size() > most) text += fmt::format(" and {} more", names.size() - most);
  return text;
}

std::string read_log_bytes(const std::filesystem::path& path) {
  std::error_code ec;
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in || std::filesystem::is_directory(path, ec))
    throw Error({path.generic_string(), "cannot be read", "a misspelt path", "check the path and the permissions of the file"});
  std::string bytes(static_cast<std::size_t>(std::max<std::streamoff>(0, in.tellg())), '\0');
  in.seekg(0);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!in) throw Error({path.generic_string(), "cannot be read", "", "check the permissions of the file"});
  return bytes;
}

ColumnTable parse_csv(std::string_view text, const std::filesystem::path& path, const std::set<std::string>* wanted,
                      const CsvFormat& format) {
  Lines lines{text};
  if (lines.rest.starts_with("\xEF\xBB\xBF")) lines.rest.remove_prefix(3);  // an editor's mark of UTF-8
  ColumnTable table;
  table.label = path.filename().generic_string();
  const std::string given = fmt::format("{}", fmt::join(format.header, std::string(1, format.separator)));
  const auto header = given.empty() ? lines.next() : std::optional<std::string_view>(given);
  if (!header) bad(path, lines.number + 1, "has no row of column names", "the file is empty or was cut", "make the log again");

  std::vector<std::vector<double>*> keep;
  split(*header, format.separator, [&](std::size_t, std::string_view cell) {
    table.names.emplace_back(trimmed(cell));
    const std::string& name = table.names.back();
    keep.push_back(nullptr);
    if (wanted && !wanted->contains(name)) return;
    if (table.has(name)) bad(path, lines.number, fmt::format("has the column \"{}\" twice", name), "", "rename one of them");
    keep.back() = &table.columns[name];
  });

  std::vector<double> row(keep.size());
  while (const auto line = lines.next()) {
    std::string_view bad_cell;
    std::size_t bad_index = keep.size();
    const std::size_t cells = split(*line, format.separator, [&](std::size_t i, std::string_view cell) {
      if (i >= keep.size() || !keep[i]) return;
      const auto v = number(trimmed(cell));
      if (!v && bad_index == keep.size()) bad_index = i, bad_cell = trimmed(cell);
      row[i] = v.value_or(kBlank);
    });
    if (cells != keep.size() || bad_index != keep.size()) {
      if (!lines.ended && format.cut_end == CutEnd::left_out) {
        table.notes.push_back(fmt::format("{}: line {} was cut off and is left out", table.label, lines.number));
        break;
      }
      if (cells != keep.size())
        bad(path, lines.number, fmt::format("has {} cells, the header has {}", cells, keep.size()),
            cells > keep.size() ? "decimals with a comma, as some spreadsheets write, or a separator inside a cell"
            : cells == 1        ? "another separator than the mapping's, or a line that was cut"
                                : "a damaged or cut line",
            "part columns by \",\" and write decimals with \".\", or set `separator` in the mapping; repair or remove a damaged line");
      bad(path, lines.number, fmt::format("\"{}\" in column \"{}\" is not a number", bad_cell.substr(0, 40), table.names[bad_index]),
          "a damaged or edited line", "repair the cell, or leave it blank when there was no measurement");
    }
    for (std::size_t i = 0; i < keep.size(); ++i)
      if (keep[i]) keep[i]->push_back(row[i]);
    ++table.rows;
  }
  return table;
}

ColumnTable read_csv_table(const std::filesystem::path& path, const std::set<std::string>& wanted, const CsvFormat& format) {
  return parse_csv(read_log_bytes(path), path, &wanted, format);
}

}  // namespace rotorloop::log
