// `rotorloop diagnose` for logs that hold motor commands and no rotor speeds: no wrench can be fitted there, but hover demand against
// reference flights identifies a rotor, and thrust over motor voltage distinguishes flights.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "host/vehicle/model.hpp"

namespace rotorloop::cli {

struct CommandLogs {
  std::vector<std::filesystem::path> flights;
  std::vector<std::filesystem::path> reference;  // the same vehicle without a defect, two or more; none: only the flights' differences
  std::filesystem::path mapping;
  std::vector<std::string> idle_options;  // given, and of no use for such logs: refused
};

// False, and nothing done, when the first flight has rotor speeds. Else prints to stdout. Throws Error for logs that cannot be used, and
// after the last table when the reference is not of the vehicle of some flight.
bool diagnose_command_logs(const CommandLogs& logs, const host::VehicleModel& vehicle);

}  // namespace rotorloop::cli
