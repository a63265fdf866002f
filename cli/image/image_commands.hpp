// The commands below `rotorloop image`; cli/commands.hpp has the group.
#pragma once

namespace CLI {
class App;
}

namespace rotorloop::cli {

void add_image_create(CLI::App& image_group, int& exit_code);
void add_image_info(CLI::App& image_group, int& exit_code);
void add_image_sign(CLI::App& image_group, int& exit_code);
void add_image_verify(CLI::App& image_group, int& exit_code);
void add_image_keygen(CLI::App& image_group, int& exit_code);

}  // namespace rotorloop::cli
