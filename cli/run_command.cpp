#include "cli/run_command.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "cli/shipped_files.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

const CLI::App* subcommand(const CLI::App& app, const std::string& name) {
  const auto found = app.get_subcommands([&](const CLI::App* s) { return s->get_name() == name; });
  return found.empty() ? nullptr : found.front();
}

// "rotorloop hil compare": the commands that the words name, for the advice to ask for their help.
std::string command_of(const CLI::App& app, int argc, const char* const* argv) {
  std::string name = app.get_name().empty() ? "rotorloop" : app.get_name();
  const CLI::App* at = &app;
  for (int i = 1; i < argc; ++i) {
    const CLI::App* sub = subcommand(*at, argv[i]);
    if (!sub) break;
    name += " " + sub->get_name();
    at = sub;
  }
  return name;
}

// CLI11 only says that a command is missing; the user wrote one, misspelt.
void refuse_unknown_command(const CLI::App& app, int argc, const char* const* argv) {
  if (argc < 2 || argv[1][0] == '-' || subcommand(app, argv[1])) return;
  std::vector<std::string> names;
  for (const auto* sub : app.get_subcommands([](const CLI::App* s) { return !s->get_group().empty(); })) names.push_back(sub->get_name());
  throw Error({"rotorloop", fmt::format("\"{}\" is not a command", argv[1]), "",
               fmt::format("use one of: {}; see rotorloop --help", fmt::join(names, ", "))});
}

}  // namespace

int run_command(CLI::App& app, int argc, const char* const* argv, const int& exit_code) {
  const std::filesystem::path share = share_folder();
  const auto missing = look_below_share(app, share);
  try {
    refuse_unknown_command(app, argc, argv);
    app.parse(argc, argv);
    std::fflush(stdout);
    if (std::ferror(stdout))
      throw Error({"stdout", "cannot be written", "the disk is full, or the reader of a pipe is gone", ""}, ExitCode::device);
    return exit_code;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // help and version
    std::fprintf(stderr, "%s: error: %s\n  do:     see %s --help\n", command_of(app, argc, argv).c_str(), e.what(),
                 command_of(app, argc, argv).c_str());
    return static_cast<int>(ExitCode::usage);
  } catch (const Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    for (const std::string& path : *missing)
      std::fprintf(stderr, "  note:   \"%s\" is neither in the working folder nor below %s\n", path.c_str(), share.generic_string().c_str());
    return static_cast<int>(e.exit_code());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "rotorloop: internal error: %s\n  do:     please report it with the command and its input files\n", e.what());
    return 1;
  }
}

}  // namespace rotorloop::cli
