// `rotorloop rotor`: the group of commands about one rotor; each adds itself.
#include <CLI/CLI.hpp>

#include "cli/commands.hpp"

namespace rotorloop::cli {

void add_rotor(CLI::App& app, int& exit_code) {
  CLI::App* rotor =
      app.add_subcommand("rotor", "a single rotor: plots, comparison with measured propellers, blade files for your own propeller");
  rotor->require_subcommand(1);
  add_rotor_plot(*rotor, exit_code);
  add_rotor_validate(*rotor, exit_code);
  add_rotor_fit(*rotor, exit_code);
  add_rotor_polar(*rotor, exit_code);
  add_rotor_bench(*rotor, exit_code);
  rotor->footer(
      "Examples:\n  rotorloop rotor plot vehicles/blades/triblade_5in.toml\n  rotorloop rotor fit folder_of_the_propeller --diameter 0.254 "
      "-o my/blades/prop.toml\n"
      "rotorloop --help lists the exit codes.");
}

}  // namespace rotorloop::cli
