// The commands below `rotorloop esc`; cli/commands.hpp has the group.
#pragma once

namespace CLI {
class App;
}

namespace rotorloop::cli {

void add_esc_parameters(CLI::App& esc_group, int& exit_code);  // get, set, save, reset
void add_esc_files(CLI::App& esc_group, int& exit_code);       // dump, restore, clone, diff
void add_esc_commission(CLI::App& esc_group, int& exit_code);
void add_esc_spin(CLI::App& esc_group, int& exit_code);
void add_esc_flash(CLI::App& esc_group, int& exit_code);
void add_esc_serve(CLI::App& esc_group, int& exit_code);  // serve, enumerate
void add_esc_monitor(CLI::App& esc_group, int& exit_code);

}  // namespace rotorloop::cli
