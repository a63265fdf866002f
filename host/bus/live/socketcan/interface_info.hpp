// CAN interfaces of this machine as the kernel tells of them by netlink (RTM_GETLINK); no privilege is needed.
#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace rotorloop {

struct CanInterface {
  std::string name;  // "can0"
  int index = 0;
  std::string kind;  // "can" (a controller), "vcan", "vxcan", "slcan"; empty where the kernel says none
  bool up = false;
  int mtu_B = 0;
  std::optional<long> bit_rate_Hz, data_rate_Hz;  // of a controller that was configured
  std::string state;                              // of a controller: "error-active", "bus-off", …
  bool fd() const { return mtu_B >= 72; }         // CANFD_MTU
  // "down", "up", or up with a state that is not error-active.
  std::string state_text() const;
};

// What a dump of links holds, as the kernel wrote it (struct nlmsghdr after struct nlmsghdr); links that are not CAN, and whatever is cut
// or does not fit its length, are passed over.
std::vector<CanInterface> parse_links(std::span<const std::byte> messages);

// Empty where there are none, and where netlink is refused.
std::vector<CanInterface> can_interfaces();

}  // namespace rotorloop
