// Every exit code of every command, in one table: `rotorloop --help`, the manual page and docs/manual.md show it. A code tells a script
// what to do next, so each has one meaning whatever the command.
#pragma once
#include <span>
#include <string>
#include <string_view>

#include "host/base/error.hpp"

namespace rotorloop::cli {

struct ExitCodeRow {
  ExitCode code;
  std::string_view name, meaning;
};
std::span<const ExitCodeRow> exit_codes();

// The table as text, a line for each code.
std::string exit_codes_text();

}  // namespace rotorloop::cli
