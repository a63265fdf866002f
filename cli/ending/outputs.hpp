// Files that a command is asked to write: refused before the work begins when they would overwrite something, or cannot be written. They
// appear under their names when they are whole (write_text_file).
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace rotorloop::cli {

// --force: replace what exists.
void add_force(CLI::App& command, bool& force);

struct OutputFile {
  std::string option;          // "-o": for the message
  std::filesystem::path path;  // empty: not asked for
};

// result.json and report.html of a report folder.
std::vector<OutputFile> report_files(const std::string& option, const std::filesystem::path& folder);

// Throws Error: usage for a file that exists and is not empty, without `force`; device for a folder that is not there. Pipes and devices
// pass. The folder of a report is made.
void check_outputs(const std::vector<OutputFile>& files, bool force);

}  // namespace rotorloop::cli
