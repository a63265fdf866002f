// Applies a mapping to the tables of a foreign log: units, axes, signs, rotor order, stamps. Judges nothing beyond what a number can
// mean at all; whether a stream is plausible is for the checks.
#pragma once
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bench/sysid/log/column_table.hpp"
#include "bench/sysid/log/flight_record.hpp"
#include "bench/sysid/log/log_mapping.hpp"

namespace rotorloop::log {

// The table of a source with the wanted columns; nothing when the log has no such file or topic.
using TableReader = std::function<std::optional<ColumnTable>(const MappedSource& source, const std::set<std::string>& wanted)>;

// Fills the streams. What was left out (blank rows, held rows, optional streams that are not there) goes to `findings` as notes.
// Throws Error (usage) for a column or source that the log lacks, with the mapping's file and line and what the log has;
// Error (data_quality) when four columns are no quaternion or a blank is refused.
void map_flight(const LogMapping& mapping, const TableReader& read_table, FlightRecord& flight, std::vector<LogFinding>& findings);

}  // namespace rotorloop::log
