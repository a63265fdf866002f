// The commands of `rotorloop stand` that speak with instruments, or play them.
#pragma once

namespace CLI {
class App;
}

namespace rotorloop::cli {

void add_stand_profile(CLI::App& stand_group, int& exit_code);
void add_stand_emulate(CLI::App& stand_group, int& exit_code);
void add_stand_read(CLI::App& stand_group, int& exit_code);
void add_stand_probe(CLI::App& stand_group, int& exit_code);
void add_stand_check(CLI::App& stand_group, int& exit_code);
void add_stand_run(CLI::App& stand_group, int& exit_code);
void add_stand_demo(CLI::App& stand_group, int& exit_code);

}  // namespace rotorloop::cli
