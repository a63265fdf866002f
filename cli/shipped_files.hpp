// Files that come with the program: `scenarios/paper.toml` is found from any folder. A path that does not exist where the command runs
// is looked for below <prefix>/share/rotorloop; only what a command reads, never what it writes.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace rotorloop::cli {

// <prefix>/share/rotorloop beside the running program; empty when there is none, as in a build tree.
std::filesystem::path share_folder();

// `path` itself when it exists, is absolute, or is not below `share`; else the file below `share`.
std::filesystem::path shipped_or_given(const std::filesystem::path& path, const std::filesystem::path& share);

// Teaches every option that names an input of the program's own formats to look below `share` too, and their defaults. Paths that were
// found in neither place are added to the list that is returned, while the command line is parsed.
std::shared_ptr<std::vector<std::string>> look_below_share(CLI::App& app, const std::filesystem::path& share);

}  // namespace rotorloop::cli
