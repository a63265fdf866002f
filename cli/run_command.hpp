// Parses the command line, runs the command, and is the one place where errors become a text on stderr and an exit code.
#pragma once

namespace CLI {
class App;
}

namespace rotorloop::cli {

// `exit_code` is what the chosen command's callback leaves. Returns the code of the process.
int run_command(CLI::App& app, int argc, const char* const* argv, const int& exit_code);

}  // namespace rotorloop::cli
