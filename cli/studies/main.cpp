// The program `rotorloop-studies`.
#include <CLI/CLI.hpp>

#include "cli/ending/exit_codes.hpp"
#include "cli/run_command.hpp"
#include "cli/studies/studies.hpp"

int main(int argc, char** argv) {
  CLI::App app{"studies of rotorloop's own parts against references, other programs and published sets", "rotorloop-studies"};
  app.require_subcommand(1);
  app.footer(rotorloop::cli::exit_codes_text());
  int exit_code = 0;
  rotorloop::cli::add_effects(app, exit_code);
  rotorloop::cli::add_nanodrone(app, exit_code);
  rotorloop::cli::add_oracles(app, exit_code);
  return rotorloop::cli::run_command(app, argc, argv, exit_code);
}
