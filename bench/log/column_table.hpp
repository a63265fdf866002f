// Columns of numbers by name, whatever they were read from; and the reader for CSV files of other tools.
#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace rotorloop::log {

struct ColumnTable {
  std::string label;                                   // for messages: "eckart00.csv", "topic esc_status of flight.ulg"
  std::vector<std::string> names;                      // all that it has
  std::map<std::string, std::vector<double>> columns;  // those that were asked for; not-a-number for a blank
  std::size_t rows = 0;
  std::vector<std::string> notes;  // what was tolerated, in words

  bool has(const std::string& name) const;
};

// One row of names, then rows of numbers; blank lines, lines that begin with '#', a byte order mark and CRLF are allowed. Blank cells,
// "nan" and "null" are not-a-number, true and false 1 and 0. Only the columns in `wanted` are kept and checked.
// A last line that was cut off is left out and noted. Throws Error (ExitCode::data_quality) with file and line for anything else.
// `header`: the names of a file that has no row of names.
ColumnTable read_csv_table(const std::filesystem::path& path, const std::set<std::string>& wanted, char separator,
                           const std::vector<std::string>& header = {});

// The whole file. Throws Error (ExitCode::usage) when it cannot be read.
std::string read_log_bytes(const std::filesystem::path& path);

// "a, b, c", at most `most` of them and then how many more.
std::string name_list(const std::vector<std::string>& names, std::size_t most = 60);

}  // namespace rotorloop::log
