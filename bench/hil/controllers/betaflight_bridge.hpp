// Betaflight's simulator target as a controller: sensors of the plant to its packets, its motor outputs to rotor speeds, and a pilot whose
// sticks are our position loop. Speaks the handshake on standard input and output, as a process of its own.
#pragma once
#include <filesystem>
#include <string>

namespace rotorloop::hil {

// Runs until standard input is closed. The program is named by the environment variable ROTORLOOP_BETAFLIGHT; what cannot be done goes out
// as {"error": …} in place of the first answer. Notes of arming, tripped ESCs and disarming go to standard error. Returns the exit code.
int serve_betaflight();

// The configuration that a flight of this vehicle and these gains would load. Throws Error: unreadable files.
std::string betaflight_config_of(const std::filesystem::path& vehicle_file, const std::filesystem::path& gains_file);

}  // namespace rotorloop::hil
