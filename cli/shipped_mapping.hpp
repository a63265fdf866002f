// Logs of PX4 and ArduPilot are read without --mapping: the shipped one of their program is taken, and said.
#pragma once
#include <filesystem>
#include <vector>

#include "bench/sysid/log/flight_set.hpp"

namespace rotorloop::cli {

inline constexpr const char* kMappingHelp =
    "mapping file: the meaning of the columns in logs of other tools; default: that of PX4 or ArduPilot for their logs";

// `given`, or where that is empty and all of `logs` are of one program that a mapping is shipped for, that mapping, with a note on stderr;
// else empty. Throws Error where a log is damaged beyond use.
std::filesystem::path mapping_or_shipped(const std::filesystem::path& given, const std::vector<std::filesystem::path>& logs);

// The same for all flights of a fit.
void take_shipped_mapping(log::FlightPaths& paths);

}  // namespace rotorloop::cli
