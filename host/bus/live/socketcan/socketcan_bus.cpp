#include "host/bus/live/socketcan/socketcan_bus.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/net_tstamp.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "host/base/error.hpp"
#include "host/bus/live/live_clock.hpp"
#include "host/bus/live/socketcan/socketcan_frame.hpp"

namespace rotorloop {
namespace {

constexpr int kReceiveBuffer_B = 4 << 20;
constexpr int kSendBuffer_B = 0;          // the kernel makes it the least it has, about six frames
constexpr std::size_t kMostOwnIds = 200;  // more, and the filters are ours alone

// The order in which frames win the bus: base identifier, then standard before extended, then the rest of the identifier.
std::uint32_t arbitration(const BusFrame& f) { return f.extended ? (f.id >> 18) << 19 | 1u << 18 | (f.id & 0x3FFFFu) : f.id << 19; }

bool interface_gone(int reason) { return reason == ENETDOWN || reason == ENODEV || reason == ENXIO; }

Descriptor raw_socket(const std::string& interface) {
  Descriptor s(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (s.get() >= 0) return s;
  const int reason = errno;
  const bool none = reason == EAFNOSUPPORT || reason == EPROTONOSUPPORT;
  throw Error(
      {"socketcan:" + interface,
       none ? "this kernel has no CAN sockets" : std::string("cannot make a CAN socket: ") + std::strerror(reason),
       none ? "a kernel without the modules can and can-raw, as those of many virtual machines" : "",
       none ? "modprobe can-raw; where that is refused use mcast:0, slcan:DEVICE, or another kernel" : "check the rights of this user"},
      ExitCode::device);
}

template <class T>
void set_option(int s, int level, int name, const T& value) {
  ::setsockopt(s, level, name, &value, sizeof value);
}

can_filter filter_of(std::uint32_t id, std::uint32_t mask, bool extended) {
  return extended ? can_filter{id | CAN_EFF_FLAG, (mask & CAN_EFF_MASK) | CAN_EFF_FLAG}
                  : can_filter{id, (mask & CAN_SFF_MASK) | CAN_EFF_FLAG};
}

}  // namespace

SocketCanBus::SocketCanBus(const SocketCanSettings& settings) : socket_(raw_socket(settings.interface)) {
  interface_ = ready_interface(settings, can_interfaces());
  fd_ = interface_.fd;
  if (interface_.state == "error-passive") state_ = BusState::error_passive;
  const int s = socket_.get();
  set_option(s, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, fd_ ? 1 : 0);
  set_option(s, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, 1);
  set_option(s, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, static_cast<can_err_mask_t>(CAN_ERR_MASK));
  if (::setsockopt(s, SOL_SOCKET, SO_RCVBUFFORCE, &kReceiveBuffer_B, sizeof kReceiveBuffer_B) != 0)
    set_option(s, SOL_SOCKET, SO_RCVBUF, kReceiveBuffer_B);
  int granted = 0;
  socklen_t size = sizeof granted;
  if (::getsockopt(s, SOL_SOCKET, SO_RCVBUF, &granted, &size) == 0) link_.receive_buffer_B = static_cast<std::uint64_t>(granted);
  set_option(s, SOL_SOCKET, SO_SNDBUF, kSendBuffer_B);
  set_option(s, SOL_SOCKET, SO_RXQ_OVFL, 1);
  set_option(s, SOL_SOCKET, SO_TIMESTAMPING, static_cast<int>(SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE));
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = interface_.index;
  if (::bind(s, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw Error({name(), std::string("cannot bind to the interface: ") + std::strerror(errno), "",
                 "look at: ip -details link show " + interface_.name},
                ExitCode::device);
}

void SocketCanBus::end(int reason) {
  if (!ended_.empty()) return;
  ended_ = reason == ENETDOWN                    ? "the interface was set down"
           : reason == ENODEV || reason == ENXIO ? "the interface is gone"
                                                 : std::strerror(reason);
}

SocketCanBus::Written SocketCanBus::write(const BusFrame& frame) {
  const SocketCanFrame f = to_socketcan(frame);
  while (true) {
    if (::write(socket_.get(), &f.raw, f.size) == static_cast<ssize_t>(f.size)) {
      ++handed_over_;
      return Written::done;
    }
    if (errno == EINTR) continue;
    if (errno == EAGAIN || errno == EWOULDBLOCK) return Written::later;
    if (errno == ENOBUFS) {  // the interface's queue is full: poll() would say that it is writable all the same
      ++link_.send_retries;
      retry_ns_ = live_now_ns() + kRetry_ns;
      return Written::later;
    }
    if (interface_gone(errno)) end(errno);
    return Written::refused;
  }
}

// With filters in the kernel a frame of ours is confirmed only where a filter fits it.
void SocketCanBus::note_own(const BusFrame& frame) {
  if (!kernel_filters_) return;
  if (own_ids_.insert(frame.id | (frame.extended ? CAN_EFF_FLAG : 0u)).second) install_filters();
}

SendStatus SocketCanBus::send_any(const BusFrame& frame) {
  const auto dropped = [&](SendStatus why) {
    ++counted_.dropped_tx;
    return why;
  };
  if (!ended_.empty() || state_ == BusState::bus_off) return dropped(SendStatus::bus_off);
  if (frame.fd && !fd_) return dropped(SendStatus::queue_full);
  note_own(frame);
  if (queue_.empty()) {
    const Written w = write(frame);
    if (w == Written::done) return SendStatus::queued;
    if (w == Written::refused) return dropped(ended_.empty() ? SendStatus::queue_full : SendStatus::bus_off);
  }
  if (queue_.size() >= kQueue) return dropped(SendStatus::queue_full);
  queue_.emplace(arbitration(frame), frame);
  return SendStatus::queued;
}

void SocketCanBus::flush() {
  if (retry_ns_ > live_now_ns()) return;
  retry_ns_ = 0;
  while (!queue_.empty()) {
    const Written w = write(queue_.begin()->second);
    if (w == Written::later) return;
    if (w == Written::refused) ++counted_.dropped_tx;
    queue_.erase(queue_.begin());
  }
}

void SocketCanBus::take_error(const can_frame& frame) {
  const BusErrorReport r = error_report(frame);
  ++link_.error_reports;
  counted_.error_frames += r.protocol || r.no_acknowledge;
  counted_.dropped_rx += r.receive_overflow;
  if (r.state && *r.state != state_) {
    state_ = *r.state;
    if (state_ == BusState::bus_off) {  // what waits would be old when the controller is back
      counted_.dropped_tx += queue_.size();
      queue_.clear();
    }
  }
  last_error_ = words(r);
}

// When the message came, by the bus's clock; counts what the system lost before it.
std::int64_t SocketCanBus::take_control(msghdr& message, std::int64_t now_ns) {
  std::int64_t time_ns = now_ns;
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SO_TIMESTAMPING) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
      time_ns = now_ns - stamp_age_ns(stamp);
    } else if (c->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t overflow = 0;
      std::memcpy(&overflow, CMSG_DATA(c), sizeof overflow);
      counted_.dropped_rx += overflow - overflow_;
      overflow_ = overflow;
    }
  }
  return time_ns;
}

std::optional<StampedBusFrame> SocketCanBus::receive_any() {
  while (ended_.empty()) {
    alignas(8) std::array<std::uint8_t, CANFD_MTU> bytes{};
    alignas(cmsghdr) std::array<char, 256> control{};
    iovec part{.iov_base = bytes.data(), .iov_len = bytes.size()};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = ::recvmsg(socket_.get(), &message, 0);
    if (size < 0) {
      if (errno == EINTR) continue;
      if (errno == EAGAIN || errno == EWOULDBLOCK) return std::nullopt;
      end(errno);
      break;
    }
    StampedBusFrame received;
    received.time_ns = take_control(message, live_now_ns());
    if ((message.msg_flags & MSG_CONFIRM) != 0) {
      ++counted_.sent;
      continue;
    }
    switch (from_socketcan({bytes.data(), static_cast<std::size_t>(size)}, received.frame)) {
      case SocketCanContent::malformed:
        ++link_.malformed;
        continue;
      case SocketCanContent::remote:
        ++link_.remote;
        continue;
      case SocketCanContent::error_report: {
        can_frame report{};
        std::memcpy(&report, bytes.data(), sizeof report);
        take_error(report);
        continue;
      }
      case SocketCanContent::frame:
        break;
    }
    if (!wanted(received.frame.id, received.frame.extended)) {
      ++counted_.filtered;
      continue;
    }
    ++counted_.received;
    return received;
  }
  throw Error({name(), ended_, "someone set it down, or the adapter was unplugged", "set it up again and start again; --wait waits for it"},
              ExitCode::device);
}

bool SocketCanBus::set_filters(std::span<const CanFilter> filters) {
  if (!CanBus::set_filters(filters)) return false;
  kernel_filters_.reset();
  if (!filters.empty()) kernel_filters_.emplace(filters.begin(), filters.end());
  install_filters();
  return true;
}

void SocketCanBus::install_filters() {
  std::vector<can_filter> list;
  if (kernel_filters_ && own_ids_.size() <= kMostOwnIds) {
    for (const CanFilter& f : *kernel_filters_) list.push_back(filter_of(f.id, f.mask, f.extended));
    for (const std::uint32_t id : own_ids_) list.push_back({id, CAN_EFF_FLAG | CAN_EFF_MASK});
  } else {
    list.push_back({0, 0});
  }
  ::setsockopt(socket_.get(), SOL_CAN_RAW, CAN_RAW_FILTER, list.data(), static_cast<socklen_t>(list.size() * sizeof(can_filter)));
}

std::int64_t SocketCanBus::now_ns() const { return live_now_ns(); }

void SocketCanBus::wait_until(std::int64_t deadline_ns) {
  TimedBus* const alone = this;
  wait_for_any({&alone, 1}, deadline_ns);
}

LinkCounters SocketCanBus::link_counters() const {
  LinkCounters counters = link_;
  counters.fd_passed_over = fd_passed_over_;
  counters.unconfirmed = handed_over_ - counted_.sent;
  return counters;
}

}  // namespace rotorloop
