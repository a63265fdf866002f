#include "host/bus/live/socketcan/socketcan_port.hpp"

#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "host/bus/live/live_clock.hpp"
#include "host/bus/live/socketcan/frame_codec.hpp"

namespace rotorloop {
namespace {

constexpr std::size_t kBatch = 64;               // frames a call of the system takes at most
constexpr std::size_t kControl_B = 128;          // stamps (48) and the count of lost frames (4), with their heads
constexpr std::size_t kMostKernelFilters = 512;  // CAN_RAW_FILTER_MAX
constexpr std::int64_t kBitsOfAFrame = 135;      // 29-bit identifier, 8 bytes, stuff bits as they come on average

bool is_set(const timespec& t) { return t.tv_sec != 0 || t.tv_nsec != 0; }

}  // namespace

struct SocketCanPort::Batch {
  std::array<canfd_frame, kBatch> frames{};
  std::array<iovec, kBatch> parts{};
  struct alignas(cmsghdr) Control {
    std::array<char, kControl_B> bytes{};
  };
  std::array<Control, kBatch> controls{};
  std::array<mmsghdr, kBatch> messages{};

  Batch() {
    for (std::size_t i = 0; i < kBatch; ++i) {
      parts[i] = {.iov_base = &frames[i], .iov_len = sizeof frames[i]};
      msghdr& m = messages[i].msg_hdr;
      m.msg_iov = &parts[i];
      m.msg_iovlen = 1;
      m.msg_control = controls[i].bytes.data();
      m.msg_controllen = kControl_B;
    }
  }
};

int can_socket_trouble() {
  const int tried = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  if (tried < 0) return errno;
  ::close(tried);
  return 0;
}

SocketCanPort::SocketCanPort(const SocketCanSettings& settings) : settings_(settings), batch_(std::make_unique<Batch>()) {
  try {
    open();
  } catch (...) {
    if (socket_ >= 0) ::close(socket_);
    throw;
  }
  frame_ns_ = kBitsOfAFrame * 1'000'000'000 / link_info_.bit_rate_Hz.value_or(1'000'000);
}

SocketCanPort::~SocketCanPort() { ::close(socket_); }

void SocketCanPort::ask_for(int option, const void* value, unsigned size, const char* step) {
  if (::setsockopt(socket_, SOL_CAN_RAW, option, value, size) != 0) throw socket_refusal(settings_, step, errno);
}

void SocketCanPort::open() {
  socket_ = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (socket_ < 0) throw socket_refusal(settings_, "cannot make a CAN socket", errno);
  link_info_ = choose_interface(settings_, can_interfaces());
  const int on = 1;
  const can_err_mask_t all_errors = CAN_ERR_MASK;
  ask_for(CAN_RAW_RECV_OWN_MSGS, &on, sizeof on, "cannot ask for echoes of own frames");
  ask_for(CAN_RAW_ERR_FILTER, &all_errors, sizeof all_errors, "cannot ask for error reports");
  if (link_info_.fd()) ask_for(CAN_RAW_FD_FRAMES, &on, sizeof on, "cannot ask for CAN FD");
  // The limit of the system holds for all but root.
  const int wanted = kWantedReceiveBuffer_B;
  if (::setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &wanted, sizeof wanted) != 0)
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &wanted, sizeof wanted);
  int granted = 0;
  socklen_t size = sizeof granted;
  if (::getsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &granted, &size) == 0) link_.receive_buffer_B = static_cast<std::uint64_t>(granted);
  ::setsockopt(socket_, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
  const int stamps =
      SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE | SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE;
  ::setsockopt(socket_, SOL_SOCKET, SO_TIMESTAMPING, &stamps, sizeof stamps);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = link_info_.index;
  if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw socket_refusal(settings_, "cannot bind to the interface", errno);
}

SocketCanPort::Write SocketCanPort::write(const BusFrame& frame) {
  canfd_frame raw{};
  const std::size_t size = encode_socketcan(frame, raw);
  if (::send(socket_, &raw, size, MSG_NOSIGNAL) == static_cast<ssize_t>(size)) {
    ++taken_;
    return Write::taken;
  }
  const int reason = errno;
  if (reason == ENOBUFS) {
    ++link_.no_buffer;
    retry_ns_ = live_now_ns() + frame_ns_;
    return Write::full;
  }
  if (reason == EAGAIN) return Write::full;
  if (ends_the_connection(reason)) lose(reason);
  return Write::refused;
}

SendStatus SocketCanPort::send_any(const BusFrame& frame) {
  if (lost_ != 0 || state() == BusState::bus_off) {
    ++counted_.dropped_tx;
    return SendStatus::bus_off;
  }
  if (frame.fd && !link_info_.fd()) {
    ++link_.fd_refused;
    ++counted_.dropped_tx;
    return SendStatus::queue_full;
  }
  if (!filters_.empty()) hear_own(frame);
  if (queue_.empty()) {
    switch (write(frame)) {
      case Write::taken:
        return SendStatus::queued;
      case Write::refused:
        ++counted_.dropped_tx;
        return SendStatus::queue_full;
      case Write::full:
        break;
    }
  }
  if (queue_.push(frame, live_now_ns())) return SendStatus::queued;
  ++counted_.dropped_tx;
  return SendStatus::queue_full;
}

void SocketCanPort::drop_stale() {
  const std::size_t dropped = queue_.drop_stale(live_now_ns());
  link_.stale += dropped;
  counted_.dropped_tx += dropped;
}

void SocketCanPort::flush() {
  if (queue_.empty() || lost_ != 0) return;
  drop_stale();
  if (retry_ns_ != INT64_MAX && live_now_ns() < retry_ns_) return;
  retry_ns_ = INT64_MAX;
  while (!queue_.empty() && lost_ == 0) {
    const Write result = write(queue_.front());
    if (result == Write::full || lost_ != 0) return;
    if (result == Write::refused) ++counted_.dropped_tx;
    queue_.pop();
  }
}

// From now on reads would block for ever: the first reason is the last that comes.
void SocketCanPort::lose(int reason) {
  if (lost_ != 0) return;
  lost_ = reason;
  counted_.dropped_tx += queue_.clear();
}

void SocketCanPort::fill() {
  for (std::size_t i = 0; i < count_; ++i) batch_->messages[i].msg_hdr.msg_controllen = kControl_B;  // the system had shortened it
  next_ = count_ = 0;
  if (lost_ != 0) return;
  const int received = ::recvmmsg(socket_, batch_->messages.data(), kBatch, MSG_DONTWAIT, nullptr);
  if (received > 0) count_ = static_cast<std::size_t>(received);
  if (received < 0 && ends_the_connection(errno)) lose(errno);
}

void SocketCanPort::read_control(std::size_t i, StampedBusFrame& received) {
  msghdr& message = batch_->messages[i].msg_hdr;
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SO_TIMESTAMPING) {
      scm_timestamping stamps{};
      std::memcpy(&stamps, CMSG_DATA(c), sizeof stamps);
      const timespec &system = stamps.ts[0], &adapter = stamps.ts[2];
      if (is_set(system)) received.time_ns = live_time_ns(system);
      if (is_set(adapter))
        received.time_ns = adapter_clock_.on_the_bus_ns(adapter.tv_sec * 1'000'000'000 + adapter.tv_nsec, received.time_ns);
    } else if (c->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t overflow = 0;
      std::memcpy(&overflow, CMSG_DATA(c), sizeof overflow);
      counted_.dropped_rx += overflow - overflow_;
      overflow_ = overflow;
    }
  }
}

std::optional<StampedBusFrame> SocketCanPort::take(std::size_t i) {
  const mmsghdr& message = batch_->messages[i];
  StampedBusFrame received;
  const bool own = (message.msg_hdr.msg_flags & MSG_CONFIRM) != 0;
  read_control(i, received);
  if (own) {
    ++counted_.sent;
    errors_.confirmed();
    return std::nullopt;
  }
  switch (decode_socketcan(batch_->frames[i], message.msg_len, received.frame)) {
    case SocketCanContent::malformed:
      ++link_.malformed;
      return std::nullopt;
    case SocketCanContent::remote:
      ++link_.remote;
      return std::nullopt;
    case SocketCanContent::error_report:
      ++link_.error_reports;
      ++counted_.error_frames;
      if (auto notice = errors_.take(decode_error_report(batch_->frames[i]))) notices_.push_back(std::move(*notice));
      return std::nullopt;
    case SocketCanContent::frame:
      break;
  }
  if (received.time_ns == 0) received.time_ns = live_now_ns();  // no stamp came with it
  // Filters for echoes of own frames let those of others with the same identifier pass.
  if (!wanted(received.frame.id, received.frame.extended)) {
    ++counted_.filtered;
    return std::nullopt;
  }
  ++counted_.received;
  return received;
}

std::optional<StampedBusFrame> SocketCanPort::receive_any() {
  for (bool emptied = false;;) {
    while (next_ < count_) {
      if (const auto received = take(next_++)) return received;
    }
    if (emptied) break;
    fill();
    emptied = count_ < kBatch;  // this call took all that there was
  }
  if (lost_ != 0) throw interface_lost(settings_, lost_);
  return std::nullopt;
}

std::int64_t SocketCanPort::now_ns() const { return live_now_ns(); }

void SocketCanPort::wait_until(std::int64_t deadline_ns) {
  TimedBus* const alone = this;
  wait_for_any({&alone, 1}, deadline_ns);
}

LinkCounters SocketCanPort::link_counters() const {
  LinkCounters counters = link_;
  counters.fd_passed_over = fd_passed_over_;
  counters.unconfirmed = taken_ - counted_.sent;
  return counters;
}

std::optional<std::string> SocketCanPort::next_notice() {
  if (notices_.empty()) return std::nullopt;
  std::string notice = std::move(notices_.front());
  notices_.pop_front();
  return notice;
}

bool SocketCanPort::set_filters(std::span<const CanFilter> filters) {
  if (!CanBus::set_filters(filters)) return false;
  filters_.assign(filters.begin(), filters.end());
  own_ids_.clear();
  install_filters();
  return true;
}

// Echoes of own frames pass the same filters as frames of others: without one for them nothing would be confirmed.
void SocketCanPort::hear_own(const BusFrame& frame) {
  if (own_ids_.insert(frame.id | (frame.extended ? CAN_EFF_FLAG : 0u)).second) install_filters();
}

void SocketCanPort::install_filters() {
  std::vector<can_filter> kernel;
  for (const CanFilter& f : filters_) kernel.push_back(kernel_filter(f));
  for (const std::uint32_t id : own_ids_) {
    const bool extended = (id & CAN_EFF_FLAG) != 0;
    kernel.push_back(kernel_filter({.id = id & CAN_EFF_MASK, .mask = CAN_EFF_MASK, .extended = extended}));
  }
  // More than it has: all frames, and wanted() chooses.
  if (filters_.empty() || kernel.size() > kMostKernelFilters) kernel.assign(1, can_filter{});
  ::setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FILTER, kernel.data(), static_cast<socklen_t>(kernel.size() * sizeof(can_filter)));
}

}  // namespace rotorloop
