#include "sim/mcu/gdb/server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "host/base/error.hpp"
#include "sim/mcu/gdb/session.hpp"

namespace rotorloop::mcu::gdb {
namespace {

constexpr int kLook_ms = 100;  // how often a stop is looked for while nothing arrives

bool readable(int fd, int wait_ms) {
  pollfd p{fd, POLLIN, 0};
  return ::poll(&p, 1, wait_ms) > 0;
}

bool send_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<size_t>(sent));
  }
  return true;
}

}  // namespace

Server::Server(uint16_t port) : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const int one = 1;
  ::setsockopt(listener_.get(), SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 || ::listen(listener_.get(), 1) != 0)
    throw Error({fmt::format("127.0.0.1:{}", port), fmt::format("cannot listen for a debugger: {}", std::strerror(errno)),
                 "another program has the port", "choose another port, or 0 for any that is free"},
                ExitCode::device);
  socklen_t size = sizeof address;
  ::getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
}

bool Server::serve(DebugTarget& target, const std::function<bool()>& stop) {
  while (!readable(listener_.get(), kLook_ms))
    if (stop()) return false;
  const Descriptor peer(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  if (peer.get() < 0) return false;
  const int one = 1;
  ::setsockopt(peer.get(), IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
  Session session(target);
  char buffer[4096];
  while (!stop()) {
    if (readable(peer.get(), session.running() ? 0 : kLook_ms)) {
      const ssize_t bytes = ::recv(peer.get(), buffer, sizeof buffer, 0);
      if (bytes <= 0 || !send_all(peer.get(), session.receive({buffer, static_cast<size_t>(bytes)}))) return false;
    }
    if (session.ended()) return false;
    if (session.detached()) return true;
    if (session.running() && !send_all(peer.get(), session.run())) return false;
  }
  return false;
}

}  // namespace rotorloop::mcu::gdb
