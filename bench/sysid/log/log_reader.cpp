#include "bench/sysid/log/log_reader.hpp"

#include <fmt/format.h>

#include "host/base/error.hpp"

namespace rotorloop::log {
namespace {

[[noreturn]] void bad(const std::string& where, std::string what, std::string likely, std::string remedy) {
  throw Error({where, std::move(what), std::move(likely), std::move(remedy)}, ExitCode::data_quality);
}

// The lines of `text` before the row of names: which format it is, and `# key: value`.
std::map<std::string, std::string> read_header(std::string_view text, const std::string& file) {
  std::map<std::string, std::string> header;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // an editor's mark of UTF-8
  for (std::size_t number = 1;; ++number) {
    const auto end = text.find('\n');
    std::string_view line = text.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (number == 1 && line != "# rotorloop flight log 1" && line != "# rotorloop truth log 1")
      bad(file + ":1", "is not a rotorloop log of a known format", "a log of another tool, or of a newer rotorloop",
          "give a mapping file (-m) for a log of another tool; a log of rotorloop has the first line \"# rotorloop flight log 1\" or "
          "\"# rotorloop truth log 1\"");
    if (line.find(',') == std::string_view::npos && line.find(';') != std::string_view::npos && !line.starts_with('#'))
      bad(fmt::format("{}:{}", file, number), "has \";\" between its columns",
          "a spreadsheet program with another language setting saved it",
          "use \",\" between columns and \".\" in decimals; or give a mapping file (-m) with separator = \";\"");
    if (!line.starts_with("# ") || end == std::string_view::npos) return header;
    if (const auto colon = line.find(": "); colon != std::string_view::npos)
      header[std::string(line.substr(2, colon - 2))] = std::string(line.substr(colon + 2));
    text.remove_prefix(end + 1);
  }
}

}  // namespace

const std::vector<double>& LogTable::column(std::string_view name) const {
  const auto it = columns.find(name);
  if (it == columns.end())
    bad(path.generic_string(), fmt::format("has no column \"{}\"", name), "a log of another kind or of another tool",
        "columns it has: " + name_list(names));
  return it->second;
}

LogTable read_log(const std::filesystem::path& path, const std::set<std::string>& wanted, CutEnd cut_end) {
  const std::string text = read_log_bytes(path);
  LogTable log;
  log.path = path;
  log.header = read_header(text, path.generic_string());
  static_cast<ColumnTable&>(log) = parse_csv(text, path, wanted.empty() ? nullptr : &wanted, {.cut_end = cut_end});
  return log;
}

}  // namespace rotorloop::log
