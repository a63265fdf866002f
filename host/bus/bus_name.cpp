// The table of backends. A new one is a row here; the README of this folder lists the other files that it needs.
#include "host/bus/bus_name.hpp"

#include <array>

#include "host/base/error.hpp"

namespace rotorloop {
namespace {

constexpr std::array<BusBackendInfo, 6> kBackends{{
    {BusBackend::virtual_bus, "virtual", "nothing, or a label", false, true},
    {BusBackend::multicast, "mcast", "a group number 0..9, or nothing for 0", false, true},
    {BusBackend::slcan, "slcan", "a serial adapter, for example /dev/ttyACM0 or /dev/ttyACM0@500000", true, true},
    {BusBackend::slcan_server, "slcan-server", "a path for the link to the terminal, or nothing", false, true},
    {BusBackend::socketcan, "socketcan", "an interface, for example can0 or can0@1000000", true, true},
    {BusBackend::gs_usb, "gsusb", "serial number of a USB adapter, or nothing for the only one; /1@500000", false, true},
}};

std::string list_of_built_in(std::span<const BusBackendInfo> backends) {
  std::string list;
  for (const BusBackendInfo& b : backends) {
    if (b.built_in) list += (list.empty() ? "" : ", ") + std::string(b.prefix) + ":";
  }
  return list;
}

[[noreturn]] void refuse(const std::string& where, std::string what, std::string likely, std::string remedy) {
  throw Error({.where = where, .what = std::move(what), .likely = std::move(likely), .remedy = std::move(remedy)});
}

}  // namespace

std::span<const BusBackendInfo> bus_backends() { return kBackends; }

BusName parse_bus_name(std::string_view text, const std::string& where, std::span<const BusBackendInfo> backends) {
  const std::string quoted = "\"" + std::string(text) + "\"";
  const std::string use = "use one that this build contains: " + list_of_built_in(backends);
  const std::size_t colon = text.find(':');
  const std::string_view prefix = text.substr(0, colon);
  for (const BusBackendInfo& b : backends) {
    if (b.prefix != prefix) continue;
    if (colon == std::string_view::npos)
      refuse(where, "bus " + quoted + " has no colon", "", "write " + quoted.substr(0, quoted.size() - 1) + ":\"");
    const std::string_view rest = text.substr(colon + 1);
    if (!b.built_in) refuse(where, "bus " + quoted + ": this build has no " + std::string(b.prefix) + " backend", "", use);
    if (b.rest_required && rest.empty()) {
      refuse(where, "bus " + quoted + " is not complete: behind the colon stands " + std::string(b.rest), "", "add it to the name");
    }
    return {.backend = b.backend, .rest = std::string(rest)};
  }
  refuse(where, "bus " + quoted + " names no known backend", "a bare interface name needs its backend before it, as in socketcan:can0",
         use);
}

}  // namespace rotorloop
