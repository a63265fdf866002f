// A FlightRecord as ULog, under PX4's topic and field names and in its axes (NED, FRD), so that PX4's tools show it and
// vehicles/measured/px4_ulog.mapping.toml reads it back. Differences from PX4's own topics are named in docs/files.md.
#pragma once
#include <string>

#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::log {

inline constexpr const char* kULogExtraTopic = "rotorloop_extra";  // one multi id for each extra; its name is an information message
std::string ulog_extra_key(int multi_id);                          // key of that message: "rotorloop_extra_0"
inline constexpr const char* kULogSystem = "rotorloop";            // as `sys_name`, where PX4 has its own
inline constexpr const char* kULogTimeShiftKey = "rotorloop_time_shift_s";  // text; seconds that were added to every stamp

// Stamps are rounded to 1 µs; values but `extra` to single precision, as PX4 logs them. A record that begins before t = 0 is moved
// by whole seconds, and the log says by how many. Throws Error (data_quality) for stamps beyond 1e10 s or more than 256 extras.
std::string ulog_bytes(const FlightRecord& flight);

}  // namespace rotorloop::log
