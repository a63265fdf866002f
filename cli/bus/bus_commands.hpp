// The commands below `rotorloop bus`; cli/commands.hpp has the group.
#pragma once

namespace CLI {
class App;
}

namespace rotorloop::cli {

void add_bus_dump(CLI::App& bus_group, int& exit_code);
void add_bus_stat(CLI::App& bus_group, int& exit_code);
void add_bus_replay(CLI::App& bus_group, int& exit_code);
void add_bus_bridge(CLI::App& bus_group, int& exit_code);
void add_bus_adapter(CLI::App& bus_group, int& exit_code);

}  // namespace rotorloop::cli
