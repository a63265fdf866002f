#include "host/bus/live/socketcan/interface_choice.hpp"

#include <cerrno>
#include <charconv>
#include <cstring>

namespace rotorloop {
namespace {

constexpr std::size_t kLongestName = 15;  // IFNAMSIZ without its zero
constexpr long kDroneCan_Hz = 1'000'000;

long rate(std::string_view text, const std::string& where, long most_Hz) {
  long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < 10'000 || value > most_Hz)
    throw Error({where, "bit rate \"" + std::string(text) + "\" is out of range: 10000 to " + std::to_string(most_Hz) + " bit/s", "",
                 "write socketcan:can0@1000000, or socketcan:can0@1000000,4000000 for CAN FD"});
  return value;
}

// What sets a controller up; vcan and vxcan have no bit rate.
std::string set_up_lines(const CanInterface& link, const SocketCanSettings& s) {
  const std::string name = " " + link.name;
  if (link.kind != "can") return "sudo ip link set" + name + " up";
  std::string line =
      "sudo ip link set" + name + " type can bitrate " + std::to_string(s.bit_rate_Hz.value_or(link.bit_rate_Hz.value_or(kDroneCan_Hz)));
  if (s.data_rate_Hz) line += " dbitrate " + std::to_string(*s.data_rate_Hz) + " fd on";
  return (link.up ? "sudo ip link set" + name + " down; " : "") + line + "; sudo ip link set" + name + " up";
}

[[noreturn]] void refuse(const SocketCanSettings& s, std::string what, std::string likely, std::string remedy) {
  throw Error({s.name(), std::move(what), std::move(likely), std::move(remedy)}, ExitCode::device);
}

void check_rate(const SocketCanSettings& s, const CanInterface& link, const char* which, std::optional<long> wanted_Hz,
                std::optional<long> has_Hz) {
  if (!wanted_Hz || link.kind != "can" || wanted_Hz == has_Hz) return;
  refuse(s,
         std::string(which) + " is " + (has_Hz ? std::to_string(*has_Hz) + " bit/s" : "not set") + ", " + std::to_string(*wanted_Hz) +
             " bit/s is asked for",
         "", set_up_lines(link, s));
}

}  // namespace

SocketCanSettings parse_socketcan_settings(const std::string& text, const std::string& where) {
  SocketCanSettings s;
  const std::size_t at = text.find('@');
  s.interface = text.substr(0, at);
  if (s.interface.empty() || s.interface.size() > kLongestName || s.interface.find_first_of("/ \t") != std::string::npos)
    throw Error({where,
                 "\"" + s.interface + "\" cannot be an interface: 1 to " + std::to_string(kLongestName) + " characters, no blank or /", "",
                 "write socketcan:can0; ip link show lists interfaces"});
  if (at == std::string::npos) return s;
  const std::string_view rates = std::string_view(text).substr(at + 1);
  const std::size_t comma = rates.find(',');
  s.bit_rate_Hz = rate(rates.substr(0, comma), where, 1'000'000);
  if (comma != std::string_view::npos) s.data_rate_Hz = rate(rates.substr(comma + 1), where, 8'000'000);
  return s;
}

CanInterface choose_interface(const SocketCanSettings& s, std::span<const CanInterface> there) {
  std::string names;
  for (const CanInterface& link : there) {
    names += (names.empty() ? "" : ", ") + link.name;
    if (link.name != s.interface) continue;
    if (!link.up) refuse(s, "the interface is down", "", set_up_lines(link, s));
    if (link.state == "bus-off")
      refuse(s, "the interface is bus-off: it left the bus after too many errors",
             "wiring, termination, or another bit rate than the others", set_up_lines(link, s));
    check_rate(s, link, "bit rate", s.bit_rate_Hz, link.bit_rate_Hz);
    if (s.data_rate_Hz && !link.fd())
      refuse(s, "the interface carries no CAN FD (MTU " + std::to_string(link.mtu_B) + ", CAN FD has 72)", "",
             link.kind == "can" ? set_up_lines(link, s) : "sudo ip link set " + link.name + " mtu 72");
    check_rate(s, link, "bit rate of CAN FD's data", s.data_rate_Hz, link.data_rate_Hz);
    return link;
  }
  refuse(s, "there is no CAN interface of this name; there " + (names.empty() ? "is none at all" : "are: " + names),
         names.empty() ? "the adapter is not plugged in, or its driver is not loaded" : "",
         names.empty() ? "see what the kernel found with: ip -details link show type can" : "use one of those");
}

Error socket_refusal(const SocketCanSettings& s, const std::string& step, int reason) {
  const bool no_can = reason == EAFNOSUPPORT || reason == EPROTONOSUPPORT;
  const bool no_right = reason == EPERM || reason == EACCES;
  return Error({s.name(), step + ": " + std::strerror(reason),
                no_can     ? "this kernel has no CAN, or its modules are not loaded"
                : no_right ? "a sandbox or container keeps this program from CAN sockets; they need no privilege otherwise"
                           : "",
                no_can     ? "sudo modprobe can_raw; in a container: on the machine itself"
                : no_right ? "run it outside, or allow address family AF_CAN there"
                           : "see the state of the interface with: ip -details link show " + s.interface},
               ExitCode::device);
}

Error interface_lost(const SocketCanSettings& s, int reason) {
  const bool down = reason == ENETDOWN;
  return Error({s.name(), down ? "the interface went down" : "the interface is gone",
                down ? "it was set down, or its adapter was unplugged" : "its adapter was unplugged, or the interface was deleted",
                "set it up (sudo ip link set " + s.interface + " up) and start again; commands with --wait go on by themselves"},
               ExitCode::device);
}

bool ends_the_connection(int reason) { return reason == ENETDOWN || reason == ENODEV || reason == ENXIO; }

}  // namespace rotorloop
