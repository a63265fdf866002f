// Runs a program as a process of its own and waits: what it prints goes to files, its messages also line by line to whoever shows
// progress. The loop is closed by separate processes because one of them must not be able to know what another knows.
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/hil/closed_loop/sandbox.hpp"

namespace rotorloop::closed_loop {

struct ProgramCall {
  std::filesystem::path program;                 // an executable of the system's own format; absolute
  std::vector<std::string> arguments;            // without the program's name
  std::filesystem::path folder;                  // it starts in; with `sandbox` the only one that it can write
  std::filesystem::path output, errors;          // files for its standard output and its messages
  std::optional<SandboxLayers> sandbox;          // sandboxed; with nothing but PATH and LANG in the environment
  std::function<void(const std::string&)> line;  // called with each line of its messages
  const std::atomic<bool>* stop = nullptr;       // true: it is asked to end (SIGINT)
};

// Its exit code, or 128 + the signal that ended it. Throws Error (device) when it cannot be started or sandboxed.
int run_program(const ProgramCall& call);

// This very program.
std::filesystem::path own_program();

}  // namespace rotorloop::closed_loop
