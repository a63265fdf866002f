// What other programs do to a CSV file and ours does not: UTF-16, rows above the names, names on two rows, a row of units below them.
#pragma once
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bench/sysid/log/csv_cells.hpp"
#include "host/base/utf8.hpp"

namespace rotorloop::log {

using rotorloop::as_utf8;

struct CsvHead {
  std::vector<std::string> names;
  CsvLines below;                  // the rows of numbers
  std::vector<std::string> notes;  // what was passed over
};

// The row of names is, of the first rows, the one that holds most of `wanted`; where none of them stands anywhere, the fullest row above
// the first row of numbers that has its width. A name that stands there more than once is led by what stands above it ("Rotation X"), a
// blank one is replaced by it; names of several columns in one cell hold for the blank cells to its right. Rows below the names that hold
// no number are units.
CsvHead find_csv_head(std::string_view text, char separator, const std::set<std::string>& wanted, const std::string& label);

// Of "," ";" and tab the one that parts the row of names of a file that nobody has described.
char likely_separator(std::string_view text);

}  // namespace rotorloop::log
