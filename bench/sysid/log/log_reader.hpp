// Reads flight.csv and truth.csv: columns by name, empty cells as not-a-number.
#pragma once
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bench/sysid/log/column_table.hpp"

namespace rotorloop::log {

// Columns go by their full names, "p_x[m]".
struct LogTable : ColumnTable {
  std::filesystem::path path;
  std::map<std::string, std::string> header;  // the `# key: value` lines

  // Throws Error (ExitCode::data_quality) naming the file and the column when there is none of that name.
  const std::vector<double>& column(std::string_view name) const;
};

// `wanted`: the columns to keep (names that the log does not have are left out); empty: all.
// Throws Error (ExitCode::data_quality) with file and line: not a rotorloop log, a row of another length, not a number.
LogTable read_log(const std::filesystem::path& path, const std::set<std::string>& wanted = {}, CutEnd cut_end = CutEnd::refused);

}  // namespace rotorloop::log
