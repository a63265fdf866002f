#include "bench/sysid/log/column_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <string_view>

#include "bench/sysid/log/foreign_csv.hpp"
#include "host/base/error.hpp"

namespace rotorloop::log {
namespace {

[[noreturn]] void bad(const std::filesystem::path& path, std::size_t line, std::string what, std::string likely, std::string remedy) {
  throw Error({fmt::format("{}:{}", path.generic_string(), line), std::move(what), std::move(likely), std::move(remedy)},
              ExitCode::data_quality);
}

constexpr double kLonger = 1.5;  // of the names: rows this much longer have commas in their numbers, unless these have points

// Rows of another length than the names': what of a foreign file's is read all the same.
struct RowWidths {
  std::size_t names = 0, first_row = 0, longer = 0, shorter = 0, repeated_heads = 0, last_head = 0;

  // `filled`: cells up to the last that holds something; `pointed`: its numbers have decimal points, so that commas part cells.
  bool surplus(std::size_t cells, std::size_t filled, bool pointed) const {
    return cells > names && (pointed || static_cast<double>(filled) < kLonger * static_cast<double>(names));
  }
  // A program that names columns which it does not write leaves out the last of them in all rows alike.
  bool all_short(std::size_t cells) const { return cells == first_row && cells < names && 2 * cells >= names && cells > 1; }

  void note(ColumnTable& table) const {
    if (longer > 0)
      table.notes.push_back(fmt::format("{}: {} of {} rows have more cells than the {} names; what has no name is left out", table.label,
                                        longer, table.rows, names));
    if (shorter > 0)
      table.notes.push_back(fmt::format("{}: {} of {} rows have {} cells for {} names; the last {} names have no values there", table.label,
                                        shorter, table.rows, first_row, names, names - first_row));
    if (repeated_heads > 0)
      table.notes.push_back(fmt::format("{}: the row of names comes {} more times, last in line {}: the log was begun anew there; read on",
                                        table.label, repeated_heads, last_head));
  }
};

// The row of names once more, of a program that was started again on the same file. Names that differ where a column is kept would put
// values into wrong columns.
bool repeats_names(const ColumnTable& table, const std::vector<std::vector<double>*>& keep, std::string_view line, std::size_t number,
                   const CsvFormat& format, const std::filesystem::path& path) {
  const std::string_view first = csv_cell(line.substr(0, line.find(format.separator)));
  if (!format.foreign || !format.header.empty() || first.empty() || first != table.names.front() || csv_number(first)) return false;
  std::vector<std::string> again;
  split_csv(line, format.separator, [&](std::size_t, std::string_view cell) { again.emplace_back(csv_cell(cell)); });
  for (std::size_t i = 0; i < keep.size(); ++i)
    if (keep[i] && (i >= again.size() || again[i] != table.names[i]))
      bad(path, number,
          fmt::format("is a second row of names, in which column {} is \"{}\" and was \"{}\"", i + 1, i < again.size() ? again[i] : "",
                      table.names[i]),
          "another program or version was started on the same file", "cut the file before this line and read both parts");
  return true;
}

// Columns of the names that are kept, in their order; nullptr for the others.
std::vector<std::vector<double>*> kept_columns(ColumnTable& table, const std::set<std::string>* wanted, std::size_t line,
                                               const std::filesystem::path& path) {
  std::vector<std::vector<double>*> keep;
  for (const std::string& name : table.names) {
    keep.push_back(nullptr);
    if (wanted && !wanted->contains(name)) continue;
    if (table.has(name)) bad(path, line, fmt::format("has the column \"{}\" twice", name), "", "rename one of them");
    keep.back() = &table.columns[name];
  }
  return keep;
}

CsvHead head_of(std::string_view text, const std::filesystem::path& path, const std::set<std::string>* wanted, const CsvFormat& format,
                const std::string& label) {
  CsvHead head;
  head.below.rest = text;
  if (!format.header.empty()) {
    head.names = format.header;
  } else if (format.foreign) {
    head = find_csv_head(text, format.separator, wanted ? *wanted : std::set<std::string>{}, label);
  } else if (const auto line = head.below.next()) {
    split_csv(*line, format.separator, [&](std::size_t, std::string_view cell) { head.names.emplace_back(csv_cell(cell)); });
  }
  if (head.names.empty())
    bad(path, head.below.number + 1, "has no row of column names", "the file is empty or was cut", "make the log again");
  return head;
}

[[noreturn]] void bad_width(const std::filesystem::path& path, std::size_t line, std::size_t cells, std::size_t names) {
  bad(path, line, fmt::format("has {} cells, the header has {}", cells, names),
      cells > names ? "it may be decimals with a comma, as some spreadsheets write, or a separator inside a cell"
      : cells == 1  ? "another separator than the mapping's, or a line that was cut"
                    : "a damaged or cut line",
      "separate columns by \",\" and write decimals with \".\", or set `separator` in the mapping; repair or remove a damaged line");
}

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
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // an editor's mark of UTF-8
  ColumnTable table;
  table.label = path.filename().generic_string();
  CsvHead head = head_of(text, path, wanted, format, table.label);
  CsvLines& lines = head.below;
  table.names = std::move(head.names);
  table.notes = std::move(head.notes);
  const auto keep = kept_columns(table, wanted, lines.number, path);
  RowWidths widths{.names = keep.size()};
  std::vector<double> row(keep.size());
  while (const auto line = lines.next()) {
    if (repeats_names(table, keep, *line, lines.number, format, path)) {
      ++widths.repeated_heads;
      widths.last_head = lines.number;
      continue;
    }
    std::string_view bad_cell;
    bool pointed = false;
    std::fill(row.begin(), row.end(), kBlankCell);
    std::size_t bad_index = keep.size(), filled = 0;  // cells up to the last that holds something
    const std::size_t cells = split_csv(*line, format.separator, [&](std::size_t i, std::string_view raw) {
      const std::string_view cell = csv_cell(raw);
      if (!cell.empty()) filled = i + 1;
      if (i >= keep.size() || !keep[i]) return;
      pointed = pointed || (format.separator == ',' && cell.find('.') != std::string_view::npos);
      const auto v = format.foreign ? csv_number_with_comma(cell, format.separator) : csv_number(cell);
      if (!v && bad_index == keep.size()) {
        bad_index = i;
        bad_cell = cell;
      }
      row[i] = v.value_or(kBlankCell);
    });
    if (table.rows == 0) widths.first_row = cells;
    const bool surplus = format.foreign && widths.surplus(cells, filled, pointed);
    const bool all_short = format.foreign && lines.ended && widths.all_short(cells);
    // A last column without a name has no cells in some programs' rows.
    const bool open_end = format.foreign && cells + 1 == keep.size() && table.names.back().empty();
    const bool fits = cells == keep.size() || surplus || open_end || all_short;
    if (!fits || bad_index != keep.size()) {
      if (!lines.ended && format.cut_end == CutEnd::left_out) {
        table.notes.push_back(fmt::format("{}: line {} was cut off and is left out", table.label, lines.number));
        break;
      }
      if (!fits) bad_width(path, lines.number, cells, keep.size());
      bad(path, lines.number, fmt::format("\"{}\" in column \"{}\" is not a number", bad_cell.substr(0, 40), table.names[bad_index]),
          "a damaged or edited line", "repair the cell, or leave it blank when there was no measurement");
    }
    widths.longer += surplus && filled > keep.size();
    widths.shorter += all_short && !open_end;
    for (std::size_t i = 0; i < keep.size(); ++i)
      if (keep[i]) keep[i]->push_back(row[i]);
    ++table.rows;
  }
  widths.note(table);
  return table;
}

ColumnTable read_csv_table(const std::filesystem::path& path, const std::set<std::string>& wanted, const CsvFormat& format) {
  CsvFormat of_another = format;
  of_another.foreign = true;
  return parse_csv(as_utf8(read_log_bytes(path)), path, &wanted, of_another);
}

}  // namespace rotorloop::log
