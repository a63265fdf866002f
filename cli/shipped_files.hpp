// Files that come with the program: `scenarios/paper.toml` is found from any folder. A path that does not exist where the command runs
// is looked for in the folder of shipped files; only what a command reads, never what it writes. Every command asks here.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace rotorloop::cli {

// <prefix>/share/rotorloop beside the running program: of an installed package, or, in a build tree, a link to the source tree that CMake
// lays there. Empty when there is none.
std::filesystem::path shipped_folder();

// `path` itself when it exists, is absolute, or is not among the shipped files; else the shipped file.
std::filesystem::path shipped_or_given(const std::filesystem::path& path);

// Where `path` was looked for, in words, for an error about it: "looked for /tmp/a.toml and /usr/share/rotorloop/a.toml".
std::string places_looked_in(const std::filesystem::path& path);

// Makes every option that names an input of the program's own formats find shipped files too, and its default. Paths that were found in
// neither place are added to the list that is returned, while the command line is parsed.
std::shared_ptr<std::vector<std::string>> find_shipped_inputs(CLI::App& app);

}  // namespace rotorloop::cli
