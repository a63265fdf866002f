#include "cli/run_command.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "cli/ending/refusal.hpp"
#include "cli/shipped_files.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {

int run_command(CLI::App& app, int argc, const char* const* argv, const int& exit_code) {
  const auto missing = find_shipped_inputs(app);
  const TypedCommand command = typed_command(app, argc, argv);
  const auto refused = [&](const Error& e) {
    std::fprintf(stderr, "%s\n", refusal_text(e.text(), command.name).c_str());
    for (const std::string& path : *missing) std::fprintf(stderr, "  note:   \"%s\": %s\n", path.c_str(), places_looked_in(path).c_str());
    return to_int(e.exit_code());
  };
  try {
    app.parse(argc, argv);
    std::fflush(stdout);
    if (std::ferror(stdout))
      throw Error({"stdout", "cannot be written", "the disk is full, or the reader of a pipe is gone", ""}, ExitCode::device);
    return exit_code;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);                                           // help and version
    if (const auto unknown = unknown_word(app, argc, argv)) return refused(Error(*unknown));  // what is misspelt, before what is missing
    return refused(Error(refusal_of(e, command)));
  } catch (const Error& e) {
    return refused(e);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: error: inside rotorloop: %s\n  do:     please report it with the command and its input files\n",
                 command.name.c_str(), e.what());
    return to_int(ExitCode::defect);
  }
}

}  // namespace rotorloop::cli
