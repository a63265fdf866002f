// PROFILE[@ADDRESS] on a command line: a file, or the name of a shipped profile.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/stand/instruments/profile.hpp"

namespace rotorloop::cli {

struct DeviceArgument {
  std::string name;  // "laumas_tlb", with "@2" where the same profile is named twice
  modbus::Profile profile;
  int slave = 1;
};

// The file of a profile: the path itself, devices/NAME.toml here, or among the shipped ones. Throws Error (usage) with the nearest name.
std::filesystem::path profile_path(const std::string& text);
std::vector<std::filesystem::path> shipped_profiles();
// Throws Error for unknown profiles and addresses outside 1 to 247.
std::vector<DeviceArgument> device_arguments(const std::vector<std::string>& words);

}  // namespace rotorloop::cli
