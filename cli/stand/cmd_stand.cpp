// `rotorloop stand`: the group of commands about a thrust stand; each adds itself.
#include <CLI/CLI.hpp>

#include "cli/commands.hpp"
#include "cli/stand/bus_commands.hpp"

namespace rotorloop::cli {

void add_stand(CLI::App& app, int& exit_code) {
  CLI::App* stand = app.add_subcommand(
      "stand", "thrust stand: read its instruments, run sequences, estimate motor and propeller constants with uncertainties");
  stand->require_subcommand(1);
  add_stand_profile(*stand, exit_code);
  add_stand_emulate(*stand, exit_code);
  add_stand_read(*stand, exit_code);
  add_stand_probe(*stand, exit_code);
  add_stand_check(*stand, exit_code);
  add_stand_run(*stand, exit_code);
  add_stand_demo(*stand, exit_code);
  add_stand_estimate(*stand, exit_code);
  add_stand_compare(*stand, exit_code);
  stand->footer(
      "Examples:\n  rotorloop stand demo -o demo\n  rotorloop stand run my_stand.toml --rpm 3000,9000 --dry-run\nrotorloop --help lists "
      "the exit codes.");
}

}  // namespace rotorloop::cli
