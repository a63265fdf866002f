// A FlightRecord from this house's own flight log (flight.csv) and to it. truth.csv is refused: identification never sees truth.
#pragma once
#include <filesystem>
#include <string>

#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::log {

// Pose and velocity carry the time of measurement (pose_t), everything else the time of its row. Columns that the log lacks leave
// their stream empty; columns of no stream here (commanded speeds, currents, those of a converted log) become `extra`; estimate,
// set-point and controller output are not read. A last line that was cut off is left out, with a note in `findings`. Throws Error
// (data_quality) with file and line.
FlightRecord read_own_log(const std::filesystem::path& path, std::vector<LogFinding>* findings = nullptr);

// The same columns, those of the streams that the record has, exact to the last bit; rows in order of time. Motor commands are
// `command_1[1]` …, extras go by their names.
std::string own_log_text(const FlightRecord& flight);

}  // namespace rotorloop::log
