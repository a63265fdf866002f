// `rotorloop completion bash`: completion of commands and options, from the commands themselves. For packagers; in no list of commands.
#pragma once
#include <string>

namespace CLI {
class App;
}

namespace rotorloop::cli {

// Bash code that completes commands and options of `app`, and names of files.
std::string bash_completion(const CLI::App& app);

void add_completion(CLI::App& app);

}  // namespace rotorloop::cli
