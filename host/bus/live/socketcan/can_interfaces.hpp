// The CAN interfaces of this machine as the kernel lists them (rtnetlink, linux/can/netlink.h): what a user can name, and what is wrong
// with the one that was named.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace rotorloop {

struct CanInterface {
  std::string name{};  // "can0"
  int index = 0;
  std::string kind{};  // "can" (a controller), "vcan", "vxcan", "slcan"; empty where the driver does not say
  bool up = false;
  bool fd = false;                     // takes FD frames (MTU 72)
  std::uint32_t bit_rate_Hz = 0;       // 0: has none, or none is set yet
  std::uint32_t data_bit_rate_Hz = 0;  // of FD data; 0: none
  std::string state{};                 // "error-active", "bus-off", "stopped"; empty where there is no controller
};

// "can, up, 1000000 bit/s, FD data 4000000 bit/s, error-active".
std::string words(const CanInterface& interface);

// The interfaces in rtnetlink's answer (a run of RTM_NEWLINK messages); those of other networks are passed over.
std::vector<CanInterface> can_interfaces(std::span<const std::uint8_t> messages);
// Those of this machine now; empty where the kernel has no netlink or no CAN interface.
std::vector<CanInterface> can_interfaces();

// "socketcan:can0[@BITRATE[,DATARATE]]"
struct SocketCanSettings {
  std::string interface;
  std::uint32_t bit_rate_Hz = 0;       // that the interface must have; 0: whatever it has
  std::uint32_t data_bit_rate_Hz = 0;  // FD as well
};
// Throws Error (exit 2); `where` is what the message points at.
SocketCanSettings parse_socketcan_settings(const std::string& text, const std::string& where);

// The interface that `wanted` names, ready for use. Throws Error (device) that says what is missing and the command that mends it: no such
// interface (lists those there are), down, another bit rate, no FD.
CanInterface ready_interface(const SocketCanSettings& wanted, std::span<const CanInterface> present);

}  // namespace rotorloop
