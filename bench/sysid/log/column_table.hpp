// Columns of numbers by name, whatever they were read from; and the one reader of CSV files, our own logs' and other tools'.
#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop::log {

struct ColumnTable {
  std::string label;                                                // for messages: "eckart00.csv", "topic esc_status of flight.ulg"
  std::vector<std::string> names;                                   // all that it has, in its order
  std::map<std::string, std::vector<double>, std::less<>> columns;  // those that were asked for; not-a-number for a blank
  std::size_t rows = 0;
  std::vector<std::string> notes;  // what was tolerated, in words

  bool has(std::string_view name) const { return columns.contains(name); }
};

// A last line without its end, of a program that was stopped while it wrote: an error where it cannot be read, or left out and noted.
enum class CutEnd { refused, left_out };

struct CsvFormat {
  char separator = ',';
  CutEnd cut_end = CutEnd::left_out;
  std::vector<std::string> header = {};  // the names of a file that has no row of names
  bool foreign = false;                  // another program wrote it: what find_csv_head allows, decimal commas, rows longer than the names
};

// One row of names, then rows of numbers; blank lines, lines that begin with '#', a byte order mark and CRLF are allowed. Blank cells,
// "nan" and "null" are not-a-number, true and false 1 and 0. Only the columns in `wanted` (nullptr: all) are kept and checked.
// Of a foreign file cells beyond the names are left out and noted, unless rows have half as many again and no decimal point, as decimals
// with a comma make; rows that all lack the last columns are read, and so is a log that was begun anew in the same file (names repeated).
// Throws Error (ExitCode::data_quality) with file, line, column and value for anything else; `path` is for messages.
ColumnTable parse_csv(std::string_view text, const std::filesystem::path& path, const std::set<std::string>* wanted,
                      const CsvFormat& format);

// The same of a whole file of another program, in UTF-8 or UTF-16. Throws Error (ExitCode::usage) when it cannot be read.
ColumnTable read_csv_table(const std::filesystem::path& path, const std::set<std::string>& wanted, const CsvFormat& format);

// The whole file. Throws Error (ExitCode::usage) when it cannot be read.
std::string read_log_bytes(const std::filesystem::path& path);

// "a, b, c", at most `most` of them and then how many more.
std::string name_list(const std::vector<std::string>& names, std::size_t most = 60);

}  // namespace rotorloop::log
