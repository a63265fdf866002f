// `rotorloop mcu`: programs for a microcontroller, without the microcontroller. Here the group.
#include <CLI/CLI.hpp>

#include "cli/commands.hpp"
#include "cli/mcu/mcu_commands.hpp"

namespace rotorloop::cli {

void add_mcu(CLI::App& app, int& exit_code) {
  CLI::App* group = app.add_subcommand("mcu", "an STM32G431 in software: what a program is, and what it does");
  group->require_subcommand(1);
  add_mcu_info(*group, exit_code);
  add_mcu_run(*group, exit_code);
}

}  // namespace rotorloop::cli
