#include "bench/log/log_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

#include "host/base/error.hpp"

namespace rotorloop::log {
namespace {

[[noreturn]] void bad(const std::filesystem::path& path, std::size_t line, std::string what, std::string likely, std::string remedy) {
  throw Error({line ? fmt::format("{}:{}", path.generic_string(), line) : path.generic_string(), std::move(what), std::move(likely),
               std::move(remedy)},
              ExitCode::data_quality);
}

std::string whole_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) bad(path, 0, "cannot be read", "the run was stopped before the log was written", "check the path; fly the run again");
  std::string text(static_cast<std::size_t>(in.tellg()), '\0');
  in.seekg(0);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!in) bad(path, 0, "cannot be read", "", "check its permissions");
  return text;
}

struct RowFault {
  std::string what, likely, remedy;
};

// The lines of a file, without their ends.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {
    if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);  // an editor's mark of UTF-8
  }
  std::optional<std::string_view> next() {
    if (rest_.empty()) return std::nullopt;
    const auto end = rest_.find('\n');
    auto line = rest_.substr(0, end);
    ended_ = end != std::string_view::npos;
    if (line.ends_with('\r')) line.remove_suffix(1);
    rest_.remove_prefix(ended_ ? end + 1 : rest_.size());
    ++number_;
    return line;
  }
  std::size_t number() const { return number_; }  // of the last line, from 1
  bool ended() const { return ended_; }           // it had its line feed
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
  bool ended_ = true;
};

std::string_view read_header(const std::filesystem::path& path, Lines& lines, std::map<std::string, std::string>& header) {
  auto line = lines.next();
  if (!line || (*line != "# rotorloop flight log 1" && *line != "# rotorloop truth log 1"))
    bad(path, 1, "is not a rotorloop log of a known format", "a log of another tool, or of a newer rotorloop",
        "expected the first line \"# rotorloop flight log 1\" or \"# rotorloop truth log 1\"");
  for (line = lines.next(); line && line->starts_with("# "); line = lines.next())
    if (const auto colon = line->find(": "); colon != std::string_view::npos)
      header[std::string(line->substr(2, colon - 2))] = std::string(line->substr(colon + 2));
  if (!line)
    bad(path, lines.number(), "ends before its row of column names", "the run was stopped before the log was written", "fly the run again");
  if (line->find(',') == std::string_view::npos && line->find(';') != std::string_view::npos)
    bad(path, lines.number(), "parts its columns by \";\"", "a spreadsheet saved it with the separators of its language",
        "part columns by \",\" and write decimals with \".\"; or read it through a mapping with separator = \";\"");
  return *line;
}

constexpr std::size_t kDropped = std::numeric_limits<std::size_t>::max();

// The cells of a line, each behind the end of its column; `target`: that column by column of the file. What is wrong with the line, or
// nothing.
std::optional<RowFault> read_row(std::string_view row, const std::vector<std::size_t>& target, const std::vector<std::string>& names,
                                 std::vector<std::vector<double>>& columns) {
  const char* p = row.data();
  const char* const end = p + row.size();
  std::size_t cell = 0;
  for (;; ++cell) {
    const char* stop = p;
    while (stop != end && *stop != ',') ++stop;
    if (cell < target.size() && target[cell] != kDropped) {
      double v = std::numeric_limits<double>::quiet_NaN();
      if (stop != p) {
        const auto [used, ec] = std::from_chars(p, stop, v);
        if (ec != std::errc{} || used != stop)
          return RowFault{
              fmt::format("\"{}\" in column \"{}\" is not a number",
                          std::string_view(p, std::min<std::size_t>(40, static_cast<std::size_t>(stop - p))), names[target[cell]]),
              "the file was edited or cut", "fly the run again"};
      }
      columns[target[cell]].push_back(v);
    }
    if (stop == end) break;
    p = stop + 1;
  }
  if (cell + 1 == target.size()) return std::nullopt;
  const std::string what = fmt::format("has {} cells, the header has {}", cell + 1, target.size());
  if (cell + 1 > target.size())
    return RowFault{what, "decimals with a comma: a spreadsheet saved it with the separators of its language",
                    "part columns by \",\" and write decimals with \".\""};
  return RowFault{what, "the run was stopped while it wrote this row", "fly the run again, or cut the last line"};
}

}  // namespace

bool LogTable::has(std::string_view name) const { return std::find(names_.begin(), names_.end(), name) != names_.end(); }

const std::vector<double>& LogTable::column(std::string_view name) const {
  const auto it = std::find(names_.begin(), names_.end(), name);
  if (it == names_.end())
    bad(path_, 0, fmt::format("has no column \"{}\"", name), "a log of another kind or of another tool",
        fmt::format("columns it has: {}", fmt::join(names_, ", ")));
  return columns_[static_cast<std::size_t>(it - names_.begin())];
}

LogTable read_log(const std::filesystem::path& path, const std::vector<std::string>& wanted, CutEnd cut_end) {
  const std::string text = whole_file(path);
  Lines lines(text);
  LogTable log;
  log.path_ = path;
  std::vector<std::size_t> target;
  for (std::string_view names = read_header(path, lines, log.header);;) {
    const auto comma = names.find(',');
    const std::string name(names.substr(0, comma));
    if (log.has(name)) bad(path, lines.number(), fmt::format("has the column \"{}\" twice", name), "", "remove one of them");
    const bool keep = wanted.empty() || std::find(wanted.begin(), wanted.end(), name) != wanted.end();
    target.push_back(keep ? log.names_.size() : kDropped);
    if (keep) log.names_.push_back(name);
    if (comma == std::string_view::npos) break;
    names.remove_prefix(comma + 1);
  }
  log.columns_.resize(log.names_.size());
  const std::string_view rest = lines.rest();
  const std::size_t rows_expected = rest.size() / std::max<std::size_t>(1, rest.find('\n') + 1) + 1;
  for (auto& c : log.columns_) c.reserve(std::min(rows_expected + rows_expected / 8, rest.size()));
  while (const auto line = lines.next()) {
    if (const auto fault = read_row(*line, target, log.names_, log.columns_)) {
      if (lines.ended() || cut_end == CutEnd::refused) bad(path, lines.number(), fault->what, fault->likely, fault->remedy);
      for (auto& c : log.columns_) c.resize(log.rows);
      log.cut_off = fmt::format("line {} was cut off and is left out", lines.number());
      break;
    }
    ++log.rows;
  }
  return log;
}

}  // namespace rotorloop::log
