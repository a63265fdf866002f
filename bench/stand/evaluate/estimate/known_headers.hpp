// CSV files whose columns need no mapping, as their header says what they are: exports of RCbenchmark and Tyto stands, and the
// samples.csv of a run folder.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "bench/stand/evaluate/stand_mapping.hpp"

namespace rotorloop::stand {

struct KnownCsv {
  std::string text;      // with "," between cells and "." in decimals, whatever the file had
  StandMapping mapping;  // of its columns
  std::vector<std::string> remarks;
};

// `bytes`: the whole file. Throws Error (usage) for a header that is neither.
KnownCsv recognise_csv(std::string bytes, const std::filesystem::path& path);

}  // namespace rotorloop::stand
