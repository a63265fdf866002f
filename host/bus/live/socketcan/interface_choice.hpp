// Which interface a bus name means, and the refusals that can be seen before a frame is sent. Pure.
#pragma once
#include <optional>
#include <span>
#include <string>

#include "host/base/error.hpp"
#include "host/bus/live/socketcan/interface_info.hpp"

namespace rotorloop {

struct SocketCanSettings {
  std::string interface;                          // "can0"
  std::optional<long> bit_rate_Hz, data_rate_Hz;  // what it has to be set to; not said: as it is
  std::string name() const { return "socketcan:" + interface; }
};

// "can0", "can0@500000", "can0@1000000,4000000" (the second: of CAN FD's data, which asks for CAN FD). Throws Error (exit 2); `where` is
// what the message points at.
SocketCanSettings parse_socketcan_settings(const std::string& text, const std::string& where);

// The interface, usable now. Throws Error (exit 3): not there (with those that are), down, another bit rate, no CAN FD, bus-off; each with
// the command that mends it.
CanInterface choose_interface(const SocketCanSettings& settings, std::span<const CanInterface> there);

// What opening a socket, or a read or write of it, failed by.
Error socket_refusal(const SocketCanSettings& settings, const std::string& step, int reason);
// The interface went down or away while it was in use: `reason` is ENETDOWN, ENODEV or ENXIO.
Error interface_lost(const SocketCanSettings& settings, int reason);
// The reasons that end a connection: after the first one, reads block for ever and nothing more is reported.
bool ends_the_connection(int reason);

}  // namespace rotorloop
