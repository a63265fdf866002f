// The commands below `rotorloop mcu`; cli/commands.hpp has the group.
#pragma once

namespace CLI {
class App;
}

namespace rotorloop::cli {

void add_mcu_info(CLI::App& mcu_group, int& exit_code);
void add_mcu_run(CLI::App& mcu_group, int& exit_code);

}  // namespace rotorloop::cli
