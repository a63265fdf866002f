// Runs a controller library in this process and speaks the handshake for it: a library that crashes or hangs takes down a child, not the
// run.
#pragma once
#include <filesystem>

namespace rotorloop::hil {

// Reads questions from standard input until it is closed, answers on standard output; what the library prints goes to standard error.
// Returns the exit code. Why a library cannot be used goes out as {"error": …}, in place of the first answer.
int serve_library(const std::filesystem::path& library);

}  // namespace rotorloop::hil
