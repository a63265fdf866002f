#include "host/bus/live/socketcan/can_interfaces.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/netlink.h>
#include <linux/if.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>

#include "host/base/error.hpp"

namespace rotorloop {
namespace {

constexpr unsigned short kCanHardware = 280;  // ARPHRD_CAN; <linux/if_arp.h> and <net/if.h> cannot be included together
constexpr std::array kStates{"error-active", "error-warning", "error-passive", "bus-off", "stopped", "sleeping"};  // enum can_state

// Each attribute in a run of them: use(type, its bytes).
template <class Use>
void for_each_attribute(std::span<const std::uint8_t> bytes, Use&& use) {
  while (bytes.size() >= sizeof(rtattr)) {
    rtattr a{};
    std::memcpy(&a, bytes.data(), sizeof a);
    if (a.rta_len < sizeof a || a.rta_len > bytes.size()) return;
    use(static_cast<unsigned>(a.rta_type & NLA_TYPE_MASK), bytes.subspan(RTA_LENGTH(0), a.rta_len - RTA_LENGTH(0)));
    bytes = bytes.subspan(std::min<std::size_t>(RTA_ALIGN(a.rta_len), bytes.size()));
  }
}

template <class T>
T value_of(std::span<const std::uint8_t> bytes) {
  T value{};
  std::memcpy(&value, bytes.data(), std::min(sizeof value, bytes.size()));
  return value;
}

std::string text_of(std::span<const std::uint8_t> bytes) {
  const auto end = std::find(bytes.begin(), bytes.end(), std::uint8_t{0});
  return std::string(bytes.begin(), end);
}

void take_controller(std::span<const std::uint8_t> data, CanInterface& out) {
  for_each_attribute(data, [&](unsigned type, std::span<const std::uint8_t> value) {
    if (type == IFLA_CAN_BITTIMING) out.bit_rate_Hz = value_of<can_bittiming>(value).bitrate;
    if (type == IFLA_CAN_DATA_BITTIMING) out.data_bit_rate_Hz = value_of<can_bittiming>(value).bitrate;
    if (type == IFLA_CAN_STATE)
      if (const auto s = value_of<std::uint32_t>(value); s < kStates.size()) out.state = kStates[s];
  });
}

void take_link_info(std::span<const std::uint8_t> info, CanInterface& out) {
  std::span<const std::uint8_t> data;
  for_each_attribute(info, [&](unsigned type, std::span<const std::uint8_t> value) {
    if (type == IFLA_INFO_KIND) out.kind = text_of(value);
    if (type == IFLA_INFO_DATA) data = value;
  });
  if (out.kind == "can") take_controller(data, out);
}

CanInterface interface_of(const ifinfomsg& info, std::span<const std::uint8_t> attributes) {
  CanInterface out;
  out.index = info.ifi_index;
  out.up = (info.ifi_flags & IFF_UP) != 0;
  for_each_attribute(attributes, [&](unsigned type, std::span<const std::uint8_t> value) {
    if (type == IFLA_IFNAME) out.name = text_of(value);
    if (type == IFLA_MTU) out.fd = value_of<std::uint32_t>(value) >= CANFD_MTU;
    if (type == IFLA_LINKINFO) take_link_info(value, out);
  });
  return out;
}

std::uint32_t positive_rate(std::string_view text, const std::string& where) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < 10'000 || value > 8'000'000)
    throw Error({where, fmt::format("bit rate \"{}\" is out of range: 10000 to 8000000 bit/s", text), "",
                 "write socketcan:can0@1000000, or @1000000,4000000 with the rate of FD data"});
  return value;
}

std::string names_of(std::span<const CanInterface> present) {
  std::string text;
  for (const CanInterface& i : present) text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", i.name, i.up ? "up" : "down");
  return text;
}

std::string set_up_line(const CanInterface& i, const SocketCanSettings& wanted) {
  const std::string& name = i.name;
  if (i.kind != "can") return fmt::format("ip link set {} up", name);
  const auto rate = [](std::uint32_t a, std::uint32_t b, std::uint32_t c) { return a ? a : b ? b : c; };
  std::string line = fmt::format("ip link set {} down; ip link set {} up type can bitrate {}", name, name,
                                 rate(wanted.bit_rate_Hz, i.bit_rate_Hz, 1'000'000));
  if (wanted.data_bit_rate_Hz > 0) line += fmt::format(" dbitrate {} fd on", wanted.data_bit_rate_Hz);
  return line;
}

[[noreturn]] void refuse_interface(const std::string& name, std::string what, std::string likely, std::string remedy) {
  throw Error({"socketcan:" + name, std::move(what), std::move(likely), std::move(remedy)}, ExitCode::device);
}

}  // namespace

std::string words(const CanInterface& i) {
  std::string text = fmt::format("{}, {}", i.kind.empty() ? "kind not known" : i.kind, i.up ? "up" : "down");
  if (i.bit_rate_Hz > 0) text += fmt::format(", {} bit/s", i.bit_rate_Hz);
  if (i.data_bit_rate_Hz > 0)
    text += fmt::format(", FD data {} bit/s", i.data_bit_rate_Hz);
  else if (i.fd)
    text += ", takes FD frames";
  return i.state.empty() ? text : text + ", " + i.state;
}

std::vector<CanInterface> can_interfaces(std::span<const std::uint8_t> messages) {
  std::vector<CanInterface> out;
  while (messages.size() >= sizeof(nlmsghdr)) {
    nlmsghdr header{};
    std::memcpy(&header, messages.data(), sizeof header);
    if (header.nlmsg_len < NLMSG_LENGTH(0) || header.nlmsg_len > messages.size()) break;
    const auto body = messages.subspan(NLMSG_LENGTH(0), header.nlmsg_len - NLMSG_LENGTH(0));
    if (header.nlmsg_type == RTM_NEWLINK && body.size() >= sizeof(ifinfomsg)) {
      const auto info = value_of<ifinfomsg>(body);
      if (info.ifi_type == kCanHardware) out.push_back(interface_of(info, body.subspan(NLMSG_ALIGN(sizeof info))));
    }
    messages = messages.subspan(std::min<std::size_t>(NLMSG_ALIGN(header.nlmsg_len), messages.size()));
  }
  return out;
}

std::vector<CanInterface> can_interfaces() {
  const int s = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (s < 0) return {};
  struct {
    nlmsghdr header{};
    ifinfomsg info{};
  } ask;
  ask.header.nlmsg_len = sizeof ask;
  ask.header.nlmsg_type = RTM_GETLINK;
  ask.header.nlmsg_flags = NLM_F_REQUEST | NLM_F_DUMP;
  ask.info.ifi_family = AF_UNSPEC;
  std::vector<CanInterface> out;
  bool more = ::send(s, &ask, sizeof ask, 0) == sizeof ask;
  std::vector<std::uint8_t> buffer(1 << 16);
  while (more) {
    const ssize_t n = ::recv(s, buffer.data(), buffer.size(), 0);
    if (n <= 0) break;
    const std::span<const std::uint8_t> part(buffer.data(), static_cast<std::size_t>(n));
    const auto found = can_interfaces(part);
    out.insert(out.end(), found.begin(), found.end());
    // The end of a dump comes as a message of its own.
    nlmsghdr first{};
    std::memcpy(&first, part.data(), std::min(sizeof first, part.size()));
    more = first.nlmsg_type == RTM_NEWLINK;
  }
  ::close(s);
  return out;
}

SocketCanSettings parse_socketcan_settings(const std::string& text, const std::string& where) {
  SocketCanSettings s;
  const std::size_t at = text.find('@');
  s.interface = text.substr(0, at);
  if (s.interface.empty() || s.interface.size() >= IFNAMSIZ)
    throw Error({where, fmt::format("\"{}\" is no name of an interface: 1 to {} characters", s.interface, IFNAMSIZ - 1), "",
                 "write socketcan:can0; `rotorloop bus list` shows what there is"});
  if (at == std::string::npos) return s;
  const std::string_view rates = std::string_view(text).substr(at + 1);
  const std::size_t comma = rates.find(',');
  s.bit_rate_Hz = positive_rate(rates.substr(0, comma), where);
  if (comma != std::string_view::npos) s.data_bit_rate_Hz = positive_rate(rates.substr(comma + 1), where);
  return s;
}

CanInterface ready_interface(const SocketCanSettings& wanted, std::span<const CanInterface> present) {
  const auto at = std::find_if(present.begin(), present.end(), [&](const CanInterface& i) { return i.name == wanted.interface; });
  if (at == present.end())
    refuse_interface(wanted.interface, "there is no CAN interface of this name",
                     present.empty() ? "the adapter is not plugged in, or its driver is not loaded" : "",
                     present.empty() ? "plug it in and look at `ip -br link`; without hardware: modprobe vcan; ip link add vcan0 type vcan"
                                     : "use one of: " + names_of(present));
  const std::string line = set_up_line(*at, wanted);
  if (!at->up) refuse_interface(at->name, "the interface is down", "", line);
  // Interfaces without a controller have no rate.
  if (at->kind == "can" && wanted.bit_rate_Hz > 0 && at->bit_rate_Hz != wanted.bit_rate_Hz)
    refuse_interface(at->name, fmt::format("runs at {} bit/s, not at {}", at->bit_rate_Hz, wanted.bit_rate_Hz), "", line);
  if (wanted.data_bit_rate_Hz > 0 && !at->fd)
    refuse_interface(at->name, "takes no FD frames", at->kind == "can" ? "it was set up without fd on, or the adapter has none" : "",
                     at->kind == "can" ? line : fmt::format("ip link set {} mtu 72", at->name));
  if (at->kind == "can" && wanted.data_bit_rate_Hz > 0 && at->data_bit_rate_Hz != wanted.data_bit_rate_Hz)
    refuse_interface(at->name, fmt::format("sends FD data at {} bit/s, not at {}", at->data_bit_rate_Hz, wanted.data_bit_rate_Hz), "",
                     line);
  if (at->state == "bus-off")
    refuse_interface(at->name, "the controller is bus-off", "another bit rate on the bus, a short, or a missing termination", line);
  return *at;
}

}  // namespace rotorloop
