// `rotorloop rotor`: the group of commands about one rotor; each adds itself.
#include <CLI/CLI.hpp>

#include "cli/commands.hpp"

namespace rotorloop::cli {

void add_rotor(CLI::App& app, int& exit_code) {
  CLI::App* rotor = app.add_subcommand("rotor", "a single rotor: pictures of it, and the solve against measured propellers");
  rotor->require_subcommand(1);
  add_rotor_plot(*rotor, exit_code);
  add_rotor_validate(*rotor, exit_code);
  add_rotor_fit(*rotor, exit_code);
  add_rotor_polar(*rotor, exit_code);
  add_rotor_bench(*rotor, exit_code);
}

}  // namespace rotorloop::cli
