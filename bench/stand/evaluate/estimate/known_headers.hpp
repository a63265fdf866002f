// CSV files whose columns need no mapping, as their header says what they are: exports of RCbenchmark and Tyto stands, and the
// samples.csv of a run folder.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/stand/evaluate/stand_mapping.hpp"
#include "bench/sysid/log/column_table.hpp"

namespace rotorloop::stand {

struct KnownCsv {
  log::ColumnTable table;  // of the columns that are known
  StandMapping mapping;    // of its columns
  std::vector<std::string> remarks;
};

// `bytes`: the whole file, in UTF-8 or UTF-16, cells separated by ",", ";" or tab. Throws Error: usage for a header that is neither, or a
// known column with an unknown unit; data_quality for a damaged file.
KnownCsv recognise_csv(std::string bytes, const std::filesystem::path& path);

}  // namespace rotorloop::stand
