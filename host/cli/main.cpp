// The `rotorloop` command: parses, prints, calls a room below.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "bench/hil/runner.hpp"
#include "host/base/error.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/hil_commands.hpp"
#include "rotorloop_version.hpp"

int main(int argc, char** argv) {
  CLI::App app{"rotorloop: hardware-in-the-loop test bench and motor/ESC firmware toolkit"};
  app.set_version_flag("--version", std::string("rotorloop ") + rotorloop::kVersion + " (" + rotorloop::kGit + ")");
  app.require_subcommand(1);
  int exit_code = 0;
  rotorloop::cli::add_hil(app, exit_code, rotorloop::bench::run_hil);
  rotorloop::cli::add_calibrate(app, exit_code);
  rotorloop::cli::add_trajectory(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : static_cast<int>(rotorloop::ExitCode::usage);
  } catch (const rotorloop::Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return static_cast<int>(e.exit_code());
  }
  return exit_code;
}
