// The one door by which flights enter: own log, ULog, or CSV of another tool, recognised by their first bytes.
#pragma once
#include <filesystem>
#include <string_view>
#include <vector>

#include "bench/sysid/log/flight_record.hpp"
#include "bench/sysid/log/log_mapping.hpp"

namespace rotorloop::log {

// `path`: a log, or a folder that holds flight.csv. `mapping`: nullptr for own logs, which need none; given with an own log it is an
// error. Values come out in SI, in this project's frames and rotor order (flight_record.hpp), each stream with its own stamps in seconds
// from the log's own zero; nothing is resampled, and nothing judged (that is check/checks.hpp). What was tolerated or left out is added to
// `findings` as notes, when given. Throws Error: usage for a path or mapping that does not fit, data_quality for a log that is damaged
// beyond use.
FlightRecord read_flight(const std::filesystem::path& path, const LogMapping* mapping, std::vector<LogFinding>* findings = nullptr);

// The mapping among the shipped files that fits a log as its program writes it by default, by its path in the folder of shipped files:
// PX4's for a ULog whose `sys_name` is PX4 or that of our own
// ULogs, ArduPilot's for a DataFlash log; empty for every other file, and for one that is not there.
std::string_view shipped_mapping_of(const std::filesystem::path& path);

}  // namespace rotorloop::log
