// A live bus by its name.
#pragma once
#include <memory>
#include <string>

#include "host/bus/bus_name.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop {

// "mcast:0", "slcan:/dev/ttyACM0@500000", "slcan-server:/tmp/esc". Throws Error: usage for a name that cannot be one or that names a
// virtual bus (which lives within one program), device for a bus that cannot be opened. `where`: what messages point at.
std::unique_ptr<TimedBus> open_bus(const std::string& name, const std::string& where);

}  // namespace rotorloop
