// The one door by which flights enter: own log, ULog, or CSV of another tool, recognised by their first bytes.
#pragma once
#include <filesystem>
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

}  // namespace rotorloop::log
