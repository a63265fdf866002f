// Two sockets: one bound to the group to receive, one connected to it to send, whose address tells own datagrams from others'.
#include "host/bus/live/multicast_bus.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "host/base/error.hpp"
#include "host/bus/live/live_clock.hpp"
#include "host/bus/live/multicast_packet.hpp"

namespace rotorloop {
namespace {

std::string group_text(int group) { return "239.65.82." + std::to_string(group); }

[[noreturn]] void fail_to_join(int group, const std::string& step, int reason) {
  const bool no_route = reason == ENODEV || reason == ENETUNREACH;
  throw Error(
      {.where = "mcast:" + std::to_string(group),
       .what = step + " (group " + group_text(group) + ", UDP port " + std::to_string(kMulticastPort) + "): " + std::strerror(reason),
       .likely = no_route ? "no network interface has a route for multicast" : "",
       .remedy = no_route ? "for programs on this machine alone: ip link set lo up; ip route add 239.65.82.0/24 dev lo"
                          : "check that the network is up and that a firewall lets the port pass"},
      ExitCode::device);
}

}  // namespace

MulticastBus::MulticastBus(int group) : group_(group) {
  try {
    open();
  } catch (...) {
    if (in_ >= 0) ::close(in_);
    if (out_ >= 0) ::close(out_);
    throw;
  }
}

MulticastBus::~MulticastBus() {
  ::close(in_);
  ::close(out_);
}

void MulticastBus::open() {
  const int on = 1;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kMulticastPort);
  ::inet_pton(AF_INET, group_text(group_).c_str(), &address.sin_addr);

  in_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (in_ < 0) fail_to_join(group_, "cannot make a socket", errno);
  ::setsockopt(in_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (::bind(in_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    fail_to_join(group_, "cannot bind to the group", errno);
  ip_mreq membership{};
  membership.imr_multiaddr = address.sin_addr;
  membership.imr_interface.s_addr = htonl(INADDR_ANY);
  if (::setsockopt(in_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0)
    fail_to_join(group_, "cannot join the group", errno);
  // The limit of the system holds for all but root.
  const int wanted = kWantedReceiveBuffer_B;
  if (::setsockopt(in_, SOL_SOCKET, SO_RCVBUFFORCE, &wanted, sizeof wanted) != 0)
    ::setsockopt(in_, SOL_SOCKET, SO_RCVBUF, &wanted, sizeof wanted);
  int granted = 0;
  socklen_t size = sizeof granted;
  if (::getsockopt(in_, SOL_SOCKET, SO_RCVBUF, &granted, &size) == 0) link_.receive_buffer_B = static_cast<std::uint64_t>(granted);
  ::setsockopt(in_, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
  ::setsockopt(in_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);

  out_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (out_ < 0) fail_to_join(group_, "cannot make a socket", errno);
  ::setsockopt(out_, SOL_SOCKET, SO_SNDBUF, &wanted, sizeof wanted);
  if (::connect(out_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    fail_to_join(group_, "cannot reach the group", errno);
  socklen_t own_size = sizeof own_;
  ::getsockname(out_, reinterpret_cast<sockaddr*>(&own_), &own_size);
}

SendStatus MulticastBus::send_any(const BusFrame& frame) {
  std::array<std::uint8_t, kMulticastPacket> packet{};
  const std::size_t size = encode_multicast(frame, packet);
  if (::send(out_, packet.data(), size, MSG_NOSIGNAL) == static_cast<ssize_t>(size)) {
    ++counted_.sent;
    return SendStatus::queued;
  }
  ++counted_.dropped_tx;
  return SendStatus::queue_full;
}

std::optional<StampedBusFrame> MulticastBus::receive_any() {
  while (true) {
    std::array<std::uint8_t, kMulticastPacket + 1> packet{};  // one more byte: a longer datagram shows
    alignas(cmsghdr) std::array<char, 128> control{};
    sockaddr_in from{};
    iovec part{.iov_base = packet.data(), .iov_len = packet.size()};
    msghdr message{};
    message.msg_name = &from;
    message.msg_namelen = sizeof from;
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = ::recvmsg(in_, &message, 0);
    if (size < 0) return std::nullopt;
    StampedBusFrame received;
    received.time_ns = live_now_ns();
    for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
      if (c->cmsg_level != SOL_SOCKET) continue;
      if (c->cmsg_type == SO_TIMESTAMPNS) {
        timespec stamp{};
        std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
        received.time_ns = live_time_ns(stamp);
      } else if (c->cmsg_type == SO_RXQ_OVFL) {
        std::uint32_t overflow = 0;
        std::memcpy(&overflow, CMSG_DATA(c), sizeof overflow);
        counted_.dropped_rx += overflow - overflow_;
        overflow_ = overflow;
      }
    }
    if (from.sin_port == own_.sin_port && from.sin_addr.s_addr == own_.sin_addr.s_addr) {
      ++link_.own_echo;
      continue;
    }
    switch (decode_multicast({packet.data(), static_cast<std::size_t>(size)}, received.frame)) {
      case MulticastContent::malformed:
        ++link_.malformed;
        continue;
      case MulticastContent::remote:
        ++link_.remote;
        continue;
      case MulticastContent::error_report:
        ++link_.error_reports;
        continue;
      case MulticastContent::frame:
        break;
    }
    if (!wanted(received.frame.id, received.frame.extended)) {
      ++counted_.filtered;
      continue;
    }
    ++counted_.received;
    return received;
  }
}

std::int64_t MulticastBus::now_ns() const { return live_now_ns(); }

void MulticastBus::wait_until(std::int64_t deadline_ns) {
  TimedBus* const alone = this;
  wait_for_any({&alone, 1}, deadline_ns);
}

LinkCounters MulticastBus::link_counters() const {
  LinkCounters counters = link_;
  counters.fd_passed_over = fd_passed_over_;
  return counters;
}

std::string MulticastBus::name() const { return "mcast:" + std::to_string(group_); }

}  // namespace rotorloop
