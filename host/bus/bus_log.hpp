// Reads a recorded bus, whatever kind of file it is in.
#pragma once
#include <string>

#include "host/bus/logged_frames.hpp"

namespace rotorloop {

// Reads candump -L text or pcap, recognised by the first bytes. Throws Error (exit 2) with file and line (or record) on bad input.
BusLog read_bus_log(const std::string& path);

}  // namespace rotorloop
