#include "host/bus/live/open_bus.hpp"

#include "host/base/error.hpp"
#include "host/bus/live/gs_usb/gs_usb_port.hpp"
#include "host/bus/live/multicast_bus.hpp"
#include "host/bus/live/slcan_port.hpp"
#include "host/bus/live/slcan_server.hpp"
#include "host/bus/live/socketcan/socketcan_port.hpp"

namespace rotorloop {
namespace {

int multicast_group(const std::string& rest, const std::string& where) {
  if (rest.empty()) return 0;  // pydronecan takes "mcast:" for the first
  if (rest.size() == 1 && rest[0] >= '0' && rest[0] < '0' + kMulticastGroups) return rest[0] - '0';
  throw Error({where, "multicast group \"" + rest + "\": 0 to 9 are possible", "", "write mcast:0"});
}

}  // namespace

std::unique_ptr<TimedBus> open_bus(const std::string& name, const std::string& where) {
  const BusName parsed = parse_bus_name(name, where);
  switch (parsed.backend) {
    case BusBackend::multicast:
      return std::make_unique<MulticastBus>(multicast_group(parsed.rest, where));
    case BusBackend::slcan:
      return std::make_unique<SlcanPort>(parse_slcan_settings(parsed.rest, where));
    case BusBackend::slcan_server:
      return std::make_unique<SlcanServer>(parsed.rest);
    case BusBackend::socketcan:
      return std::make_unique<SocketCanPort>(parse_socketcan_settings(parsed.rest, where));
    case BusBackend::gs_usb:
      return gs_usb::open_gs_usb(gs_usb::parse_settings(parsed.rest, where));
    case BusBackend::virtual_bus:
      break;
  }
  throw Error({where, "bus \"" + name + "\" lives within one program; others cannot join it", "",
               "use mcast:0 for programs on this machine, slcan-server:PATH for a program that knows serial adapters, slcan:DEVICE, "
               "socketcan:INTERFACE or gsusb:SERIAL for hardware"});
}

}  // namespace rotorloop
