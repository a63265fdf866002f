// Clocks of 32 bits, which start anew in long logs.
#pragma once
#include <optional>
#include <vector>

#include "bench/sysid/log/column_table.hpp"
#include "bench/sysid/log/flight_record.hpp"
#include "bench/sysid/log/log_mapping.hpp"

namespace rotorloop::log {

// All clocks of one log, a table for each of the mapping's sources, read on beyond the wrap of any of them; each wrap is noted.
void unwrap_clocks(const LogMapping& m, std::vector<std::optional<ColumnTable>>& tables, std::vector<LogFinding>& findings);

}  // namespace rotorloop::log
