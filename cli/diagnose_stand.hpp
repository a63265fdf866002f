// `rotorloop diagnose --stand FILE... -m MAPPING`: thrust-stand files, for which there is no vehicle and no flight.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace rotorloop::cli {

struct DiagnoseStandOptions {
  std::vector<std::filesystem::path> files;
  std::filesystem::path mapping;
  bool json = false;
  std::uint64_t seed = 1;
  std::vector<std::string> idle_options;  // given, and of no use for stand files: refused
};

// Prints to stdout. Throws Error for files or a mapping that cannot be used.
void diagnose_stand_files(const DiagnoseStandOptions& options);

}  // namespace rotorloop::cli
