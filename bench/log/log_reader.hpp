// Reads flight.csv and truth.csv: columns by name, empty cells as not-a-number.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop::log {

// A last line without its end, of a program that was stopped while it wrote: an error, or left out.
enum class CutEnd { refused, left_out };

class LogTable {
 public:
  std::map<std::string, std::string> header;  // the `# key: value` lines
  std::size_t rows = 0;
  std::string cut_off;  // "line 812 was cut off and is left out" (CutEnd::left_out), else empty

  bool has(std::string_view column) const;  // by full name, "p_x[m]"
  // Throws Error (ExitCode::data_quality) naming the file and the column when there is none of that name.
  const std::vector<double>& column(std::string_view name) const;
  const std::vector<std::string>& names() const { return names_; }
  const std::filesystem::path& path() const { return path_; }

 private:
  friend LogTable read_log(const std::filesystem::path&, const std::vector<std::string>&, CutEnd);
  std::filesystem::path path_;
  std::vector<std::string> names_;
  std::vector<std::vector<double>> columns_;
};

// `wanted`: full names of the columns to keep (names the log does not have are left out); empty: all.
// Throws Error (ExitCode::data_quality) with file and line: not a rotorloop log, a row of another length, not a number.
LogTable read_log(const std::filesystem::path& path, const std::vector<std::string>& wanted = {}, CutEnd cut_end = CutEnd::refused);

}  // namespace rotorloop::log
