// The subcommands of `rotorloop-studies`, which is built in the tree and not installed: what judges the simulator and the identification
// against other programs and published sets. No user's task needs them.
#pragma once

namespace CLI {
class App;
}

namespace rotorloop::cli {

void add_effects(CLI::App& app, int& exit_code);
void add_nanodrone(CLI::App& app, int& exit_code);
void add_oracles(CLI::App& app, int& exit_code);

}  // namespace rotorloop::cli
