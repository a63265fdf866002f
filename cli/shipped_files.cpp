#include "cli/shipped_files.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <string_view>

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

// Options and arguments that name a file or folder which rotorloop ships examples of.
constexpr std::array<std::string_view, 18> kInputs = {"SCENARIO",  "PLAN",       "SETUP",    "STAND",           "blade",  "--vehicle",
                                                      "--mapping", "--plant",    "--blade",  "--library",       "--base", "--trajectory",
                                                      "--gains",   "--scenario", "--polars", "--hover-mapping", "--pins", "--motor"};

bool is_input(const CLI::Option& option) {
  return std::any_of(kInputs.begin(), kInputs.end(), [&](std::string_view name) { return option.check_name(std::string(name)); });
}

// Where shipped files would lie, whether they do or not; empty without /proc.
fs::path beside_program() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path() : (program.parent_path() / ROTORLOOP_SHARE_FROM_BIN).lexically_normal();
}

}  // namespace

fs::path shipped_folder() {
  std::error_code error;
  const fs::path folder = beside_program();
  return fs::is_directory(folder, error) ? folder : fs::path();
}

fs::path shipped_or_given(const fs::path& path) {
  std::error_code error;
  const fs::path folder = shipped_folder();
  if (folder.empty() || path.empty() || path.is_absolute() || fs::exists(path, error)) return path;
  const fs::path shipped = (folder / path).lexically_normal();
  return fs::exists(shipped, error) ? shipped : path;
}

std::string places_looked_in(const fs::path& path) {
  std::error_code error;
  const fs::path here = fs::absolute(path, error).lexically_normal();
  if (path.is_absolute()) return "looked for " + here.generic_string();
  const fs::path shipped = (beside_program() / path).lexically_normal();
  return fmt::format("looked for {} and {}{}", here.generic_string(), shipped.generic_string(),
                     shipped_folder().empty() ? " (no folder of shipped files is beside the program)" : "");
}

std::shared_ptr<std::vector<std::string>> find_shipped_inputs(CLI::App& app) {
  auto missing = std::make_shared<std::vector<std::string>>();
  const auto found = [missing](const std::string& word) {
    std::string path = shipped_or_given(word).generic_string();
    if (fs::path(path).is_relative() && !fs::exists(path)) missing->push_back(path);
    return path;
  };
  const auto visit = [&](auto&& self, CLI::App& at) -> void {
    for (CLI::Option* option : at.get_options([](const CLI::Option* o) { return is_input(*o); })) {
      if (const std::string preset = option->get_default_str(); !preset.empty()) {
        option->default_val(shipped_or_given(preset).generic_string());
        option->default_str(preset);  // help and man page name the file as it is shipped
      }
      option->transform(found, "");
    }
    for (CLI::App* command : at.get_subcommands([](CLI::App*) { return true; })) self(self, *command);
  };
  visit(visit, app);
  return missing;
}

}  // namespace rotorloop::cli
