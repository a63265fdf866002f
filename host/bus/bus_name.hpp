// The name of a bus as users write it, "BACKEND:REST": virtual: | mcast:0 | slcan:/dev/ttyACM0@1000000 | slcan-server:PATH |
// socketcan:can0 | gsusb:SERIAL. Only what this build contains is accepted; any other name is refused with the list of what would work,
// before anything is opened or armed.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace rotorloop {

enum class BusBackend : std::uint8_t { virtual_bus, multicast, slcan, slcan_server, socketcan, gs_usb };

struct BusBackendInfo {
  BusBackend backend;
  std::string_view prefix;  // before the colon
  std::string_view rest;    // what stands behind the colon, for messages
  bool rest_required;
  bool built_in;
};

struct BusName {
  BusBackend backend = BusBackend::virtual_bus;
  std::string rest;  // interface, serial number, group number or label
};

std::span<const BusBackendInfo> bus_backends();

// Throws Error (exit 2). `where` is what the message points at: an option or "file:line".
BusName parse_bus_name(std::string_view text, const std::string& where, std::span<const BusBackendInfo> backends = bus_backends());

}  // namespace rotorloop
