#include "bench/sysid/log/foreign_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace rotorloop::log {
namespace {

constexpr std::size_t kMostAbove = 60;  // rows above the names; programs that describe their set-up there need some dozens

struct Row {
  std::vector<std::string> cells;
  CsvLines after;
  std::size_t numbers = 0, blanks = 0, filled = 0;  // filled: cells up to the last that holds something
  bool comment = false;                             // its "#" is left out
};

std::vector<Row> first_rows(std::string_view text, char separator) {
  std::vector<Row> rows;
  CsvLines lines{.rest = text, .with_comments = true};
  std::size_t plain = 0;
  while (plain < kMostAbove) {
    auto line = lines.next();
    if (!line) break;
    Row& r = rows.emplace_back();
    r.comment = line->front() == '#';
    plain += !r.comment;
    line->remove_prefix(std::min(line->find_first_not_of('#'), line->size()));
    split_csv(*line, separator, [&](std::size_t, std::string_view raw) {
      const std::string_view cell = csv_cell(raw);
      r.cells.emplace_back(cell);
      r.blanks += cell.empty();
      if (!cell.empty()) r.filled = r.cells.size();
      const auto v = csv_number_with_comma(cell, separator);
      r.numbers += !cell.empty() && v.has_value();
    });
    r.after = lines;
    r.after.with_comments = false;
  }
  return rows;
}

bool of_numbers(const Row& r) { return !r.comment && r.numbers > 0 && r.numbers + r.blanks == r.cells.size(); }

std::vector<std::string> doubled(const std::vector<std::string>& names) {
  std::map<std::string, int> seen;
  for (const auto& n : names) ++seen[n];
  std::vector<std::string> out;
  for (const auto& [n, count] : seen)
    if (count > 1 || n.empty()) out.push_back(n);
  return out;
}

std::vector<std::string> names_of(const std::vector<Row>& rows, std::size_t row) {
  std::vector<std::string> names = rows[row].cells;
  for (std::size_t above = row; above-- > 0;) {
    const auto again = doubled(names);
    if (again.empty()) break;
    const Row& r = rows[above];
    if (r.comment || r.cells.size() + 1 < names.size() || r.numbers > 0) continue;
    // A cell above leads every name under it where it leads one that repeats: "Rotation W" beside "Rotation X".
    std::vector<std::string> lead(names.size());
    std::set<std::string> needed;
    for (std::size_t i = 0; i < names.size() && i < r.cells.size(); ++i) {
      lead[i] = !r.cells[i].empty() || i == 0 ? r.cells[i] : lead[i - 1];
      if (std::binary_search(again.begin(), again.end(), names[i])) needed.insert(lead[i]);
    }
    for (std::size_t i = 0; i < names.size(); ++i)
      if (!lead[i].empty() && needed.contains(lead[i])) names[i] = names[i].empty() ? lead[i] : lead[i] + " " + names[i];
  }
  return names;
}

std::size_t most_wanted(const std::vector<Row>& rows, const std::set<std::string>& wanted) {
  std::size_t best = rows.size(), most = 0;
  for (std::size_t i = 0; i < rows.size() && !wanted.empty(); ++i) {
    const auto names = names_of(rows, i);
    const auto hits = static_cast<std::size_t>(std::count_if(
        wanted.begin(), wanted.end(), [&](const std::string& w) { return std::find(names.begin(), names.end(), w) != names.end(); }));
    // Of a comment and a row that hold as many the row is meant.
    if (hits > most || (hits == most && most > 0 && rows[best].comment && !rows[i].comment)) {
      most = hits;
      best = i;
    }
  }
  return best;
}

std::size_t first_plain(const std::vector<Row>& rows) {
  const auto plain = std::find_if(rows.begin(), rows.end(), [](const Row& r) { return !r.comment; });
  return plain == rows.end() ? 0 : static_cast<std::size_t>(plain - rows.begin());
}

std::size_t row_of_names(const std::vector<Row>& rows, const std::set<std::string>& wanted) {
  if (const std::size_t named = most_wanted(rows, wanted); named < rows.size()) return named;
  const auto first = std::find_if(rows.begin(), rows.end(), [](const Row& r) { return of_numbers(r) && r.cells.size() > 1; });
  if (first == rows.end()) return first_plain(rows);
  const std::size_t filled = first->filled;
  const auto numbers = static_cast<std::size_t>(first - rows.begin());
  std::size_t best = 0, blanks = 0;
  bool found = false;
  for (std::size_t i = 0; i < numbers; ++i) {
    const Row& r = rows[i];
    if (r.comment || r.numbers > 0 || r.cells.size() < 2 || r.cells.size() < filled) continue;
    if (!found || r.blanks < blanks) {
      best = i;
      blanks = r.blanks;
      found = true;
    }
  }
  // Rows that are longer than the names: those are the row of text with the most cells, the nearest to the numbers.
  bool any = found;
  for (std::size_t i = 0; i < numbers && !found; ++i)
    if (!rows[i].comment && rows[i].numbers == 0 && rows[i].cells.size() > 1 && rows[i].cells.size() >= rows[best].cells.size()) {
      best = i;
      any = true;
    }
  // Names behind "#", as EuRoC's data sets have them: the last comment that is as wide as the numbers below it.
  for (std::size_t i = numbers; i-- > 0 && !any;)
    if (rows[i].comment && rows[i].numbers == 0 && rows[i].cells.size() == first->cells.size()) return i;
  return any ? best : first_plain(rows);
}

}  // namespace

CsvHead find_csv_head(std::string_view text, char separator, const std::set<std::string>& wanted, const std::string& label) {
  CsvHead head;
  head.below.rest = text;
  const std::vector<Row> rows = first_rows(text, separator);
  if (std::all_of(rows.begin(), rows.end(), [](const Row& r) { return r.comment; })) return head;
  const std::size_t row = row_of_names(rows, wanted);
  head.names = names_of(rows, row);
  head.below = rows[row].after;
  const auto above = std::count_if(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(row), [](const Row& r) { return !r.comment; });
  if (rows[row].comment)
    head.notes.push_back(fmt::format("{}: the names of its columns stand behind \"#\" in line {}", label, rows[row].after.number));
  else if (above > 0)
    head.notes.push_back(fmt::format("{}: the names of its columns are in line {}; {} row{} above passed over", label,
                                     rows[row].after.number, above, above == 1 ? "" : "s"));
  std::size_t below = row + 1;
  while (below < rows.size() && (rows[below].comment || (rows[below].numbers == 0 && rows[below].cells.size() > 1))) ++below;
  if (below > row + 1 &&
      std::any_of(rows.begin() + static_cast<std::ptrdiff_t>(row) + 1, rows.begin() + static_cast<std::ptrdiff_t>(below),
                  [](const Row& r) { return !r.comment; }) &&
      below < rows.size() && of_numbers(rows[below])) {
    head.below = rows[below - 1].after;
    head.notes.push_back(fmt::format("{}: line {} below the names holds no number (units?) and is passed over", label, head.below.number));
  }
  return head;
}

char likely_separator(std::string_view text) {
  char best = ',';
  std::size_t most = 0;
  for (const char c : {',', ';', '\t'}) {
    const std::size_t columns = find_csv_head(text, c, {}, "").names.size();
    if (columns > most) {
      most = columns;
      best = c;
    }
  }
  return best;
}

}  // namespace rotorloop::log
