#include "bench/stand/instruments/port_link.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/serial.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>

#include "bench/stand/instruments/port_clock.hpp"
#include "host/base/error.hpp"

namespace rotorloop::modbus {
namespace {

constexpr std::int64_t kReconnect_ns = 500'000'000;

timespec span_of_ns(std::int64_t ns) {
  ns = std::max<std::int64_t>(0, ns);
  return {static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
}

// Best effort: many adapters have no such setting, and pseudo-terminals none at all.
bool ask_for_low_latency(int fd) {
  serial_struct settings{};
  if (ioctl(fd, TIOCGSERIAL, &settings) != 0) return false;
  settings.flags |= ASYNC_LOW_LATENCY;
  return ioctl(fd, TIOCSSERIAL, &settings) == 0;
}

std::string likely_cause(int error, bool tcp) {
  switch (error) {
    case ENOENT:
      return "the adapter is not connected, or has another name";
    case EACCES:
      return "your user may not use serial ports";
    case EBUSY:
      return "another program holds the port";
    case ECONNREFUSED:
      return "no device listens there";
    case ETIMEDOUT:
    case EHOSTUNREACH:
      return "the device is off, or in another network";
    default:
      return tcp ? "the address is wrong, or the device is off" : "the port does not offer this rate or format";
  }
}

std::string remedy(int error, bool tcp) {
  if (tcp) return "check address and port with: ping HOST";
  if (error == EACCES) return "add your user to the group dialout and log in again";
  return "list the ports with: ls -l /dev/serial/by-id";
}

}  // namespace

PortName parse_port(const std::string& text, const std::string& where) {
  PortName p;
  std::string rest = text;
  if (rest.starts_with("rtu:")) {
    rest = rest.substr(4);
  } else if (rest.starts_with("tcp:")) {
    p.tcp = true;
    rest = rest.substr(4);
    const auto colon = rest.rfind(':');
    if (colon != std::string::npos) {
      const std::string digits = rest.substr(colon + 1);
      const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), p.port);
      if (error != std::errc() || end != digits.data() + digits.size() || p.port < 1 || p.port > 65535)
        throw Error(
            {where, fmt::format("\"{}\" has the TCP port \"{}\"", text, digits), "", "give 1 to 65535, such as tcp:192.168.1.9:502"});
      rest = rest.substr(0, colon);
    }
  }
  if (rest.empty()) throw Error({where, fmt::format("\"{}\" names no port", text), "", "give rtu:/dev/ttyUSB0 or tcp:HOST:502"});
  p.path = rest;
  return p;
}

PortLink::PortLink(const PortName& port, const SerialFormat& format) : port_(port), format_(format) {
  if (open()) return;
  throw Error(
      {port_.path,
       fmt::format("cannot be opened{}: {}", port_.tcp ? fmt::format(" (TCP port {})", port_.port) : fmt::format(" with {}", text(format_)),
                   modbus_strerror(last_errno_)),
       likely_cause(last_errno_, port_.tcp), remedy(last_errno_, port_.tcp)},
      ExitCode::device);
}

PortLink::~PortLink() { close(); }

bool PortLink::open() {
  context_ = port_.tcp ? modbus_new_tcp_pi(port_.path.c_str(), std::to_string(port_.port).c_str())
                       : modbus_new_rtu(port_.path.c_str(), format_.baud, format_.parity, 8, format_.stop_bits);
  if (context_) modbus_set_response_timeout(context_, 1, 0);  // of the TCP connection
  if (!context_ || modbus_connect(context_) != 0) {
    last_errno_ = errno;
    if (context_) modbus_free(context_);
    context_ = nullptr;
    return false;
  }
  fd_ = modbus_get_socket(context_);
  fcntl(fd_, F_SETFL, fcntl(fd_, F_GETFL) | O_NONBLOCK);
  low_latency_ = !port_.tcp && ask_for_low_latency(fd_);
  return true;
}

void PortLink::close() {
  if (context_) {
    modbus_close(context_);
    modbus_free(context_);
  }
  context_ = nullptr;
  fd_ = -1;
  next_try_ns_ = now_ns() + kReconnect_ns;
}

std::int64_t PortLink::now_ns() { return port_clock_ns(); }

bool PortLink::send(std::span<const std::uint8_t> bytes) {
  if (fd_ < 0) {
    if (now_ns() < next_try_ns_) return false;
    next_try_ns_ = now_ns() + kReconnect_ns;
    if (!open()) return false;
  }
  const std::int64_t give_up_ns = now_ns() + 1'000'000'000;
  while (!bytes.empty()) {
    const auto n = ::write(fd_, bytes.data(), bytes.size());
    if (n > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(n));
    } else if ((errno == EAGAIN || errno == EINTR) && now_ns() < give_up_ns) {
      pollfd wait{fd_, POLLOUT, 0};
      const timespec span = span_of_ns(10'000'000);
      (void)ppoll(&wait, 1, &span, nullptr);
    } else {
      close();
      return false;
    }
  }
  return true;
}

int PortLink::receive(std::span<std::uint8_t> into, std::int64_t deadline_ns) {
  for (;;) {
    pollfd wait{fd_, POLLIN, 0};
    const timespec span = span_of_ns(deadline_ns - now_ns());
    const int ready = ppoll(&wait, fd_ < 0 ? 0 : 1, &span, nullptr);
    if (fd_ < 0) {
      if (now_ns() >= deadline_ns) return -1;
      continue;
    }
    if (ready > 0) {
      const auto n = ::read(fd_, into.data(), into.size());
      if (n > 0) return static_cast<int>(n);
      const bool gone =
          (n == 0 && port_.tcp) || (n < 0 && errno != EAGAIN && errno != EINTR) || (wait.revents & (POLLHUP | POLLERR | POLLNVAL));
      if (gone) {
        close();
        return -1;
      }
    }
    if (now_ns() >= deadline_ns) return 0;
  }
}

}  // namespace rotorloop::modbus
