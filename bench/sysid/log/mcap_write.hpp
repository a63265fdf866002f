// Writes a flight as MCAP (mcap.dev/spec, version 0), which Foxglove and PlotJuggler open: JSON messages that carry their JSON schemas,
// in uncompressed chunks with an index. The topics and their units are described in docs/files.md, MCAP.
#pragma once
#include <string>

#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::log {

// Every stream is a topic of its own, with its own stamps; readings that are not there are left out of their message. MCAP's times are
// whole nanoseconds from 0 on: a flight with stamps below 0 is moved by whole seconds, which the channels' metadata say (`time_shift_s`).
// Throws Error (data_quality) for a stamp that MCAP cannot hold.
std::string mcap_bytes(const FlightRecord& flight);

}  // namespace rotorloop::log
