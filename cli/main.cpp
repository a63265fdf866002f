// The `rotorloop` command: one line for each subcommand.
#include <CLI/CLI.hpp>

#include "bench/hil/flight/flight.hpp"
#include "bench/hil/flight/runner.hpp"
#include "bench/hil/flight/vehicle_figures.hpp"
#include "cli/commands.hpp"
#include "cli/completion.hpp"
#include "cli/ending/exit_codes.hpp"
#include "cli/hil_commands.hpp"
#include "cli/run_command.hpp"
#include "rotorloop_version.hpp"

int main(int argc, char** argv) {
  CLI::App app{"rotorloop: hardware-in-the-loop test bench and motor/ESC firmware toolkit", "rotorloop"};
  app.set_version_flag("--version", std::string("rotorloop ") + rotorloop::kVersion + " (" + rotorloop::kGit + ")");
  app.require_subcommand(1);
  app.footer(rotorloop::cli::exit_codes_text());
  int exit_code = 0;
  rotorloop::cli::add_hil(app, exit_code, rotorloop::hil::run_hil, rotorloop::hil::checked_vehicle_text, rotorloop::cli::hil_bench);
  rotorloop::cli::add_airframe(app, exit_code);
  rotorloop::cli::add_fly(app, exit_code);
  rotorloop::cli::add_calibrate(app, exit_code);
  rotorloop::cli::add_vehicle(app, exit_code);
  rotorloop::cli::add_gains(app, exit_code);
  rotorloop::cli::add_close(app, exit_code);
  rotorloop::cli::add_controller(app, exit_code);
  rotorloop::cli::add_identify(app, exit_code);
  rotorloop::cli::add_diagnose(app, exit_code);
  rotorloop::cli::add_log(app, exit_code);
  rotorloop::cli::add_rotor(app, exit_code);
  rotorloop::cli::add_stand(app, exit_code);
  rotorloop::cli::add_trajectory(app, exit_code);
  rotorloop::cli::add_bus(app, exit_code);
  rotorloop::cli::add_esc(app, exit_code);
  rotorloop::cli::add_esc_sim(app, exit_code);
  rotorloop::cli::add_esc_lab(app, exit_code);
  rotorloop::cli::add_image(app, exit_code);
  rotorloop::cli::add_mcu(app, exit_code);
  rotorloop::cli::add_completion(app);
  app.footer("Examples:\n  rotorloop hil scenarios/paper.toml --seeds 1\n  rotorloop hil --help\n\n" + rotorloop::cli::exit_codes_text());
  return rotorloop::cli::run_command(app, argc, argv, exit_code);
}
