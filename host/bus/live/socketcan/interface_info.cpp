#include "host/bus/live/socketcan/interface_info.hpp"

#include <linux/can/netlink.h>
#include <linux/if.h>
#include <linux/if_arp.h>
#include <linux/if_link.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <functional>

namespace rotorloop {
namespace {

using Bytes = std::span<const std::byte>;

template <class T>
std::optional<T> read_as(Bytes bytes) {
  if (bytes.size() < sizeof(T)) return std::nullopt;
  T value{};
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

std::string text_of(Bytes bytes) {
  const char* const begin = reinterpret_cast<const char*>(bytes.data());
  return {begin, ::strnlen(begin, bytes.size())};
}

// Attributes and messages stand one behind the other, each at a multiple of four bytes.
constexpr std::size_t aligned(std::size_t length) { return (length + 3) & ~std::size_t{3}; }

void for_each_attribute(Bytes bytes, const std::function<void(int type, Bytes value)>& take) {
  while (const auto head = read_as<rtattr>(bytes)) {
    if (head->rta_len < sizeof(rtattr) || head->rta_len > bytes.size()) return;
    take(head->rta_type & NLA_TYPE_MASK, bytes.subspan(sizeof(rtattr), head->rta_len - sizeof(rtattr)));
    bytes = bytes.subspan(std::min(aligned(head->rta_len), bytes.size()));
  }
}

std::string state_name(std::uint32_t state) {
  static constexpr std::array<const char*, 6> kNames{"error-active", "error-warning", "error-passive", "bus-off", "stopped", "sleeping"};
  return state < kNames.size() ? kNames[state] : "state " + std::to_string(state);
}

void read_controller(Bytes data, CanInterface& link) {
  for_each_attribute(data, [&](int type, Bytes value) {
    if (type == IFLA_CAN_BITTIMING || type == IFLA_CAN_DATA_BITTIMING) {
      const auto timing = read_as<can_bittiming>(value);
      if (timing && timing->bitrate > 0) (type == IFLA_CAN_BITTIMING ? link.bit_rate_Hz : link.data_rate_Hz) = timing->bitrate;
    } else if (type == IFLA_CAN_STATE) {
      if (const auto state = read_as<std::uint32_t>(value)) link.state = state_name(*state);
    }
  });
}

void read_kind(Bytes info, CanInterface& link) {
  Bytes data;
  for_each_attribute(info, [&](int type, Bytes value) {
    if (type == IFLA_INFO_KIND) link.kind = text_of(value);
    if (type == IFLA_INFO_DATA) data = value;
  });
  if (link.kind == "can") read_controller(data, link);
}

std::optional<CanInterface> parse_link(Bytes body) {
  const auto head = read_as<ifinfomsg>(body);
  if (!head || head->ifi_type != ARPHRD_CAN) return std::nullopt;
  CanInterface link;
  link.index = head->ifi_index;
  link.up = (head->ifi_flags & IFF_UP) != 0;
  for_each_attribute(body.subspan(std::min(aligned(sizeof(ifinfomsg)), body.size())), [&](int type, Bytes value) {
    if (type == IFLA_IFNAME) link.name = text_of(value);
    if (type == IFLA_MTU) link.mtu_B = static_cast<int>(read_as<std::uint32_t>(value).value_or(0));
    if (type == IFLA_LINKINFO) read_kind(value, link);
  });
  if (link.name.empty()) return std::nullopt;
  return link;
}

bool ask_for_links(int descriptor) {
  struct {
    nlmsghdr head{};
    ifinfomsg body{};
  } request;
  request.head.nlmsg_len = sizeof request;
  request.head.nlmsg_type = RTM_GETLINK;
  request.head.nlmsg_flags = NLM_F_REQUEST | NLM_F_DUMP;
  return ::send(descriptor, &request, sizeof request, 0) == static_cast<ssize_t>(sizeof request);
}

bool is_last(Bytes messages) {
  bool last = false;
  while (const auto head = read_as<nlmsghdr>(messages)) {
    last = last || head->nlmsg_type == NLMSG_DONE || head->nlmsg_type == NLMSG_ERROR;
    if (head->nlmsg_len < sizeof(nlmsghdr)) return true;
    messages = messages.subspan(std::min<std::size_t>(aligned(head->nlmsg_len), messages.size()));
  }
  return last;
}

}  // namespace

std::string CanInterface::state_text() const {
  if (!up) return "down";
  return state.empty() || state == "error-active" ? "up" : "up, " + state;
}

std::vector<CanInterface> parse_links(Bytes messages) {
  std::vector<CanInterface> links;
  while (const auto head = read_as<nlmsghdr>(messages)) {
    if (head->nlmsg_len < sizeof(nlmsghdr) || head->nlmsg_len > messages.size()) break;
    if (head->nlmsg_type == RTM_NEWLINK) {
      if (auto link = parse_link(messages.subspan(sizeof(nlmsghdr), head->nlmsg_len - sizeof(nlmsghdr)))) links.push_back(*link);
    }
    messages = messages.subspan(std::min(aligned(head->nlmsg_len), messages.size()));
  }
  return links;
}

std::vector<CanInterface> can_interfaces() {
  std::vector<CanInterface> links;
  const int descriptor = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (descriptor < 0) return links;
  const timeval second{.tv_sec = 1, .tv_usec = 0};  // the kernel answers at once, or not at all
  ::setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &second, sizeof second);
  std::array<std::byte, 65536> buffer{};
  bool more = ask_for_links(descriptor);
  while (more) {
    const ssize_t size = ::recv(descriptor, buffer.data(), buffer.size(), 0);
    if (size <= 0) break;
    const Bytes messages(buffer.data(), static_cast<std::size_t>(size));
    for (CanInterface& link : parse_links(messages)) links.push_back(std::move(link));
    more = !is_last(messages);
  }
  ::close(descriptor);
  return links;
}

}  // namespace rotorloop
