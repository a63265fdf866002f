#include "cli/ending/outputs.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "host/base/error.hpp"

namespace rotorloop::cli {

namespace fs = std::filesystem;

void add_force(CLI::App& command, bool& force) { command.add_flag("--force", force, "replace files that exist"); }

std::vector<OutputFile> report_files(const std::string& option, const fs::path& folder) {
  if (folder.empty()) return {};
  std::error_code ec;
  if (fs::exists(folder, ec) && !fs::is_directory(folder, ec))
    throw Error({option, fmt::format("\"{}\" is a file, and a folder is wanted", folder.generic_string()), "", "name another folder"});
  fs::create_directories(folder, ec);
  if (ec)
    throw Error({option, fmt::format("\"{}\" cannot be made: {}", folder.generic_string(), ec.message()), "",
                 "correct the permissions, or name another folder"},
                ExitCode::device);
  return {{option, folder / "result.json"}, {option, folder / "report.html"}};
}

void check_outputs(const std::vector<OutputFile>& files, bool force) {
  for (const OutputFile& f : files) {
    if (f.path.empty()) continue;
    std::error_code ec;
    if (fs::is_directory(f.path, ec))
      throw Error({f.option, fmt::format("\"{}\" is a folder, and a file is wanted", f.path.generic_string()), "", "name a file in it"});
    const fs::path folder = f.path.has_parent_path() ? f.path.parent_path() : fs::path(".");
    if (!fs::is_directory(folder, ec))
      throw Error(
          {f.option, fmt::format("\"{}\" cannot be written: there is no folder {}", f.path.generic_string(), folder.generic_string()), "",
           fmt::format("make it first: mkdir -p {}", folder.generic_string())},
          ExitCode::device);
    if (force || !fs::is_regular_file(f.path, ec) || fs::file_size(f.path, ec) == 0) continue;
    throw Error({f.option, fmt::format("\"{}\" exists already", f.path.generic_string()), "the command was run before",
                 "name another one, or replace it with --force"});
  }
}

}  // namespace rotorloop::cli
