// A controller that is not ours, as the user names it: on the command line (--controller) or in a scenario ([[external_controller]]).
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "host/base/toml_file.hpp"

namespace rotorloop::hil {

struct ExternalController {
  std::string name;               // of the variant, is_variant_name()
  std::filesystem::path library;  // a shared library (controller_abi.h); empty: `command` is the program itself
  std::string command;            // line for /bin/sh that speaks the handshake on its standard input and output, or a bridge's name
  double timeout_s = 10.0;        // longest wait for an answer, by the wall clock
  bool from_scenario = false;     // else given for this run
  std::filesystem::path rotorloop = "rotorloop";  // the command, which runs a library as a process of its own
};

// Autopilots that `rotorloop controller NAME` puts behind the handshake, and the environment variable that names the program of each.
struct Bridge {
  const char *name, *variable;
};
inline constexpr std::array kBridges{Bridge{"betaflight", "ROTORLOOP_BETAFLIGHT"}, Bridge{"ardupilot", "ROTORLOOP_ARDUPILOT"},
                                     Bridge{"px4", "ROTORLOOP_PX4"}};
// Null: it is none of these.
const Bridge* bridge_of(const ExternalController& c);

inline constexpr double kLeastTimeout_s = 0.1, kMostTimeout_s = 600.0;

// "./my.so", "python3 my.py", "betaflight" or any of them after "NAME=". Throws Error: empty, no name to be made of it, no such library.
ExternalController parse_controller(std::string_view text);

// [[external_controller]] of a scenario; names are unique and none of ours. Throws Error with file, line and remedy.
std::vector<ExternalController> read_external_controllers(const TomlTable& root);

// The line for /bin/sh that starts it.
std::string start_line(const ExternalController& c);
// As --controller takes it, with `library` in place of its path.
std::string argument_text(const ExternalController& c, const std::string& library);
// In single quotes, for a shell.
std::string shell_quoted(const std::string& text);

}  // namespace rotorloop::hil
