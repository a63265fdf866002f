#include "cli/shipped_files.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <string_view>

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

// Options and arguments that name a file which rotorloop ships examples of.
constexpr std::array<std::string_view, 11> kInputs = {"SCENARIO", "PLAN",      "blade",        "--vehicle", "--mapping", "--plant",
                                                      "--blade",  "--library", "--trajectory", "--gains",   "--scenario"};

bool is_input(const CLI::Option& option) {
  return std::any_of(kInputs.begin(), kInputs.end(), [&](std::string_view name) { return option.check_name(std::string(name)); });
}

}  // namespace

fs::path share_folder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return {};
  const fs::path share = (program.parent_path() / ROTORLOOP_SHARE_FROM_BIN).lexically_normal();
  return fs::is_directory(share, error) ? share : fs::path();
}

fs::path shipped_or_given(const fs::path& path, const fs::path& share) {
  std::error_code error;
  if (share.empty() || path.empty() || path.is_absolute() || fs::exists(path, error)) return path;
  const fs::path shipped = (share / path).lexically_normal();
  return fs::exists(shipped, error) ? shipped : path;
}

std::shared_ptr<std::vector<std::string>> look_below_share(CLI::App& app, const fs::path& share) {
  auto missing = std::make_shared<std::vector<std::string>>();
  if (share.empty()) return missing;
  const auto found = [share, missing](const std::string& word) {
    std::string path = shipped_or_given(word, share).generic_string();
    if (fs::path(path).is_relative() && !fs::exists(path)) missing->push_back(path);
    return path;
  };
  const auto visit = [&](auto&& self, CLI::App& at) -> void {
    for (CLI::Option* option : at.get_options([](const CLI::Option* o) { return is_input(*o); })) {
      if (const std::string preset = option->get_default_str(); !preset.empty())
        option->default_val(shipped_or_given(preset, share).generic_string());
      option->transform(found, "");
    }
    for (CLI::App* command : at.get_subcommands([](CLI::App*) { return true; })) self(self, *command);
  };
  visit(visit, app);
  return missing;
}

}  // namespace rotorloop::cli
