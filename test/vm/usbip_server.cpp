#include "test/vm/usbip_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <utility>

namespace rotorloop::emulated {
namespace {

// linux/Documentation/usb/usbip_protocol.rst
constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kSubmitted = 3, kUnlinked = 4;
constexpr std::size_t kHeader_B = 48;
constexpr unsigned kFullSpeed = 2;
constexpr std::uint32_t kLargest_B = 4096;
constexpr const char* kAttach = "/sys/devices/platform/vhci_hcd.0/attach";

std::int64_t now_ns() {
  timespec t{};
  ::clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000 + t.tv_nsec;
}

bool read_all(int socket, std::uint8_t* data, std::size_t size) {
  while (size > 0) {
    const ssize_t got = ::read(socket, data, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    data += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

std::uint32_t word(const std::uint8_t* header, std::size_t index) {
  std::uint32_t value = 0;
  std::memcpy(&value, header + 4 * index, 4);
  return ntohl(value);
}

}  // namespace

UsbIpServer::~UsbIpServer() {
  for (const auto& p : plugs_) ::close(p->socket);
}

bool UsbIpServer::plug(CandlelightOptions options) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return false;
  auto p = std::make_unique<Plug>();
  std::vector<CanWire*> wires;
  for (CanWire& wire : wires_) wires.push_back(&wire);
  p->device = std::make_unique<EmulatedCandlelight>(std::move(wires), std::move(options));
  p->socket = ends[0];
  while (std::any_of(plugs_.begin(), plugs_.end(), [&](const auto& other) { return other->port == p->port; })) ++p->port;
  const std::string line = std::to_string(p->port) + " " + std::to_string(ends[1]) + " " + std::to_string((1u << 16) + 2 + p->port) + " " +
                           std::to_string(kFullSpeed);
  const int attach = ::open(kAttach, O_WRONLY | O_CLOEXEC);
  const bool done = attach >= 0 && ::write(attach, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  if (attach >= 0) ::close(attach);
  ::close(ends[1]);
  plugs_.push_back(std::move(p));
  return done;
}

bool UsbIpServer::unplug(const std::string& serial) {
  const auto at = std::find_if(plugs_.begin(), plugs_.end(), [&](const auto& p) { return p->device->options().serial == serial; });
  if (at == plugs_.end()) return false;
  ::close((*at)->socket);
  plugs_.erase(at);
  return true;
}

EmulatedCandlelight* UsbIpServer::adapter(const std::string& serial) {
  for (const auto& p : plugs_) {
    if (p->device->options().serial == serial) return p->device.get();
  }
  return nullptr;
}

bool UsbIpServer::reply(Plug& p, std::uint32_t command, std::uint32_t sequence, std::int32_t status, std::uint32_t length,
                        const Bytes& data) {
  Bytes message(kHeader_B + data.size());
  const auto put = [&](std::size_t index, std::uint32_t value) {
    value = htonl(value);
    std::memcpy(&message[4 * index], &value, 4);
  };
  put(0, command);
  put(1, sequence);
  put(5, static_cast<std::uint32_t>(status));
  put(6, length);
  std::copy(data.begin(), data.end(), message.begin() + kHeader_B);
  return ::send(p.socket, message.data(), message.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(message.size());
}

void UsbIpServer::run_out(Plug& p) {
  for (std::size_t i = 0; i < p.out.size();) {
    Urb& urb = p.out[i];
    const auto taken = urb.never ? EmulatedCandlelight::Out::never : p.device->bulk_out(urb.data, now_ns());
    urb.never = taken == EmulatedCandlelight::Out::never;
    if (taken == EmulatedCandlelight::Out::no_room) return;  // as an adapter that answers NAK
    if (urb.never) {
      ++i;
      continue;
    }
    const bool stall = taken == EmulatedCandlelight::Out::stall;
    reply(p, kSubmitted, urb.sequence, stall ? -EPIPE : 0, stall ? 0 : urb.length, {});
    p.out.erase(p.out.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void UsbIpServer::run_in(Plug& p) {
  while (!p.in.empty()) {
    auto message = p.device->bulk_in();
    if (!message) return;
    const Urb urb = p.in.front();
    p.in.pop_front();
    if (message->bytes.size() > urb.length) message->bytes.resize(urb.length);
    reply(p, kSubmitted, urb.sequence, message->stalled ? -EPIPE : 0, static_cast<std::uint32_t>(message->bytes.size()), message->bytes);
  }
}

bool UsbIpServer::take_submit(Plug& p, const std::uint8_t* header) {
  const std::uint32_t sequence = word(header, 1), endpoint = word(header, 4);
  const bool in = word(header, 3) != 0;
  Urb urb{.sequence = sequence, .length = word(header, 6), .data = {}};
  if (urb.length > kLargest_B) return false;
  if (!in) {
    urb.data.resize(urb.length);
    if (!read_all(p.socket, urb.data.data(), urb.data.size())) return false;
  }
  if (endpoint != 0) {
    (in ? p.in : p.out).push_back(std::move(urb));
    return true;
  }
  EmulatedCandlelight::Setup setup{};
  std::copy_n(header + 40, setup.size(), setup.begin());
  const auto answer = p.device->control(setup, urb.data);
  if (!answer) return reply(p, kSubmitted, sequence, -EPIPE, 0, {});
  return reply(p, kSubmitted, sequence, 0, in ? static_cast<std::uint32_t>(answer->size()) : urb.length, in ? *answer : Bytes{});
}

bool UsbIpServer::take_unlink(Plug& p, std::uint32_t sequence, std::uint32_t victim) {
  std::size_t found = 0;
  for (std::deque<Urb>* urbs : {&p.in, &p.out}) found += std::erase_if(*urbs, [&](const Urb& u) { return u.sequence == victim; });
  return reply(p, kUnlinked, sequence, found > 0 ? -ECONNRESET : 0, 0, {});
}

bool UsbIpServer::take_request(Plug& p) {
  std::array<std::uint8_t, kHeader_B> header{};
  if (!read_all(p.socket, header.data(), header.size())) return false;
  switch (word(header.data(), 0)) {
    case kSubmit:
      return take_submit(p, header.data());
    case kUnlink:
      return take_unlink(p, word(header.data(), 1), word(header.data(), 5));
    default:
      return false;
  }
}

void UsbIpServer::step() {
  for (const auto& p : plugs_) run_out(*p);
  for (CanWire& wire : wires_) wire.step(now_ns());
  for (const auto& p : plugs_) {
    run_out(*p);  // what had no room before
    run_in(*p);
  }
}

std::optional<std::int64_t> UsbIpServer::next_event_ns() const {
  std::optional<std::int64_t> first;
  for (const CanWire& wire : wires_)
    if (const auto next_ns = wire.next_event_ns(); next_ns && (!first || *next_ns < *first)) first = next_ns;
  return first;
}

void UsbIpServer::serve(int command) {
  while (true) {
    step();
    std::vector<pollfd> polled{{.fd = command, .events = POLLIN, .revents = 0}};
    for (const auto& p : plugs_) polled.push_back({.fd = p->socket, .events = POLLIN, .revents = 0});
    const auto next_ns = next_event_ns();
    const std::int64_t left_ns = next_ns ? std::max<std::int64_t>(*next_ns - now_ns(), 0) : 0;
    const timespec timeout{.tv_sec = left_ns / 1'000'000'000, .tv_nsec = left_ns % 1'000'000'000};
    if (::ppoll(polled.data(), polled.size(), next_ns ? &timeout : nullptr, nullptr) <= 0) continue;
    if (polled[0].revents != 0) return;
    for (std::size_t i = plugs_.size(); i-- > 0;) {
      if (polled[i + 1].revents == 0 || take_request(*plugs_[i])) continue;
      ::close(plugs_[i]->socket);
      plugs_.erase(plugs_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
}

}  // namespace rotorloop::emulated
