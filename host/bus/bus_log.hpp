// Reads a recorded bus, whatever kind of file it is in.
#pragma once
#include <string>

#include "host/bus/logged_frames.hpp"

namespace rotorloop {

// Reads the text of candump, pcap, .trc (PCAN-View) or .asc (Vector), recognised by the first bytes. Throws Error (exit 2) with file and
// line (or record) on bad input.
BusLog read_bus_log(const std::string& path);

}  // namespace rotorloop
