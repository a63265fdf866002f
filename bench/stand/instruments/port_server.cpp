#include "bench/stand/instruments/port_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "bench/stand/instruments/exchange.hpp"
#include "bench/stand/instruments/port_clock.hpp"
#include "bench/stand/instruments/port_link.hpp"
#include "host/base/error.hpp"

namespace rotorloop::modbus {
namespace {

constexpr std::int64_t kLook_ns = 50'000'000;    // how often `stop` is looked at
constexpr std::int64_t kForget_ns = 20'000'000;  // what was no whole request by then is forgotten

[[noreturn]] void cannot(const std::string& what) {
  throw Error({what, std::string("cannot be served: ") + std::strerror(errno), errno == EADDRINUSE ? "another program listens there" : "",
               "choose another port or path"},
              ExitCode::device);
}

void pause_until(std::int64_t time_ns) {
  for (std::int64_t left; (left = time_ns - port_clock_ns()) > 0;) {
    const timespec span{static_cast<time_t>(left / 1'000'000'000), static_cast<long>(left % 1'000'000'000)};
    (void)ppoll(nullptr, 0, &span, nullptr);
  }
}

const ServedDevice* find_device(const std::vector<ServedDevice>& devices, std::uint8_t id) {
  for (const ServedDevice& d : devices)
    if (d.id == id) return &d;
  return nullptr;
}

// A new pseudo-terminal whose far end `link` names.
class PseudoTerminal : public ByteLink {
 public:
  explicit PseudoTerminal(std::filesystem::path link) : link_(std::move(link)) {
    char name[128];
    termios raw{};
    cfmakeraw(&raw);
    if (openpty(&near_, &far_, name, &raw, nullptr) != 0) cannot(link_.generic_string());
    fcntl(near_, F_SETFL, O_NONBLOCK);
    std::error_code error;
    std::filesystem::create_symlink(name, link_, error);
    if (error) {
      errno = error.value();
      cannot(link_.generic_string());
    }
  }
  ~PseudoTerminal() override {
    std::error_code error;
    std::filesystem::remove(link_, error);
    ::close(near_);
    ::close(far_);  // held open, so that a client may come and go
  }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;
  std::int64_t now_ns() override { return port_clock_ns(); }
  bool send(std::span<const std::uint8_t> bytes) override {
    return ::write(near_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
  }
  int receive(std::span<std::uint8_t> into, std::int64_t deadline_ns) override {
    pollfd wait{near_, POLLIN, 0};
    const std::int64_t left = std::max<std::int64_t>(0, deadline_ns - port_clock_ns());
    const timespec span{static_cast<time_t>(left / 1'000'000'000), static_cast<long>(left % 1'000'000'000)};
    if (ppoll(&wait, 1, &span, nullptr) <= 0) return 0;
    const auto n = ::read(near_, into.data(), into.size());
    return n > 0 ? static_cast<int>(n) : 0;
  }

 private:
  std::filesystem::path link_;
  int near_ = -1, far_ = -1;
};

class RtuServer : public PortServer {
 public:
  RtuServer(std::unique_ptr<ByteLink> link, std::string where, const SerialFormat& format, bool paced)
      : link_(std::move(link)),
        where_(std::move(where)),
        character_ns_(format.character_ns()),
        silence_ns_(frame_gap_ns(format.baud, format.character_ns())),
        paced_(paced) {}
  std::string where() const override { return where_; }

  void serve(const std::vector<ServedDevice>& devices, const std::atomic<bool>& stop, std::int64_t until_ns) override {
    std::vector<std::uint8_t> heard;
    std::array<std::uint8_t, 512> chunk{};
    std::int64_t last_ns = 0;
    while (!stop && port_clock_ns() < until_ns) {
      const int n = link_->receive(chunk, std::min(until_ns, port_clock_ns() + (heard.empty() ? kLook_ns : kForget_ns)));
      const std::int64_t now = port_clock_ns();
      if (n <= 0 || now - last_ns > kForget_ns) {
        counts_.damaged += !heard.empty();
        heard.clear();
      }
      if (n <= 0) continue;
      last_ns = now;
      heard.insert(heard.end(), chunk.begin(), chunk.begin() + n);
      const std::size_t whole = rtu_request_bytes(heard);
      if (whole == 0 || heard.size() < whole) continue;
      heard.resize(whole);
      reply(devices, heard, now);
      heard.clear();
    }
  }

 private:
  void reply(const std::vector<ServedDevice>& devices, const std::vector<std::uint8_t>& frame, std::int64_t heard_ns) {
    const ServedDevice* const device = find_device(devices, frame[0]);
    const auto pdu = rtu_pdu(frame, frame[0]);
    if (!pdu) {
      ++counts_.damaged;
      return;
    }
    if (!device) return;
    ++counts_.requests;
    const std::int64_t request_end_ns = heard_ns + (paced_ ? static_cast<std::int64_t>(frame.size()) * character_ns_ : 0);
    const std::int64_t begin_ns = request_end_ns + std::max(device->turnaround_ns, silence_ns_);
    pause_until((request_end_ns + begin_ns) / 2);
    const auto answer = device->slave->answer(*pdu, port_clock_ns());
    if (answer.empty()) return;
    answer[0] & 0x80u ? ++counts_.refused : ++counts_.answered;
    const auto bytes = rtu_frame(device->id, answer);
    pause_until(begin_ns);
    if (!paced_) {
      (void)link_->send(bytes);
      return;
    }
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      pause_until(begin_ns + static_cast<std::int64_t>(i + 1) * character_ns_);
      (void)link_->send(std::span(bytes).subspan(i, 1));
    }
  }

  std::unique_ptr<ByteLink> link_;
  std::string where_;
  std::int64_t character_ns_, silence_ns_;
  bool paced_;
};

class TcpServer : public PortServer {
 public:
  explicit TcpServer(int port) {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int one = 1;
    setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 || listen(listener_, 8) != 0)
      cannot(fmt::format("127.0.0.1:{}", port));
    socklen_t size = sizeof address;
    getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
  }
  ~TcpServer() override {
    for (const Client& c : clients_) ::close(c.fd);
    ::close(listener_);
  }
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;
  std::string where() const override { return fmt::format("tcp:127.0.0.1:{}", port_); }

  void serve(const std::vector<ServedDevice>& devices, const std::atomic<bool>& stop, std::int64_t until_ns) override {
    while (!stop && port_clock_ns() < until_ns) {
      std::vector<pollfd> all{{listener_, POLLIN, 0}};
      for (const Client& c : clients_) all.push_back({c.fd, POLLIN, 0});
      const std::int64_t left = std::clamp<std::int64_t>(until_ns - port_clock_ns(), 0, kLook_ns);
      const timespec span{0, static_cast<long>(left)};
      if (ppoll(all.data(), all.size(), &span, nullptr) <= 0) continue;
      for (std::size_t i = clients_.size(); i-- > 0;)
        if (all[i + 1].revents && !listen_to(clients_[i], devices)) {
          ::close(clients_[i].fd);
          clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(i));
        }
      if (all[0].revents) welcome();
    }
  }

 private:
  struct Client {
    int fd;
    std::vector<std::uint8_t> heard;
  };

  void welcome() {
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return;
    if (clients_.size() >= 16) {
      ::close(fd);
      return;
    }
    const int one = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    clients_.push_back({fd, {}});
  }

  // False: the client is gone or does not speak Modbus.
  bool listen_to(Client& client, const std::vector<ServedDevice>& devices) {
    std::array<std::uint8_t, 1024> chunk{};
    const auto n = ::read(client.fd, chunk.data(), chunk.size());
    if (n <= 0) return n < 0 && (errno == EAGAIN || errno == EINTR);
    client.heard.insert(client.heard.end(), chunk.begin(), chunk.begin() + n);
    while (client.heard.size() > kMbapBytes) {
      const auto& h = client.heard;
      const std::size_t length = (std::size_t{h[4]} << 8) | h[5];
      if (h[2] != 0 || h[3] != 0 || length < 2 || length > kMaxTcpFrame - 6) return false;
      if (h.size() < 6 + length) break;
      const std::vector<std::uint8_t> frame(h.begin(), h.begin() + static_cast<std::ptrdiff_t>(6 + length));
      client.heard.erase(client.heard.begin(), client.heard.begin() + static_cast<std::ptrdiff_t>(6 + length));
      const auto reply = answer(frame, devices);
      if (!reply.empty() && ::send(client.fd, reply.data(), reply.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(reply.size())) return false;
    }
    return true;
  }

  std::vector<std::uint8_t> answer(const std::vector<std::uint8_t>& frame, const std::vector<ServedDevice>& devices) {
    const auto number = static_cast<std::uint16_t>((frame[0] << 8) | frame[1]);
    // A device behind TCP answers to any unit when it is alone, as most do.
    const ServedDevice* const device = devices.size() == 1 ? &devices.front() : find_device(devices, frame[6]);
    ++counts_.requests;
    const std::uint8_t fc = frame[kMbapBytes];
    constexpr std::uint8_t kNoTarget = 11;
    std::vector<std::uint8_t> pdu{static_cast<std::uint8_t>(fc | 0x80u), kNoTarget};
    if (device) pdu = device->slave->answer(std::span(frame).subspan(kMbapBytes), port_clock_ns());
    if (pdu.empty()) return {};
    pdu[0] & 0x80u ? ++counts_.refused : ++counts_.answered;
    return tcp_frame(number, frame[6], pdu);
  }

  int listener_ = -1, port_ = 0;
  std::vector<Client> clients_;
};

}  // namespace

std::unique_ptr<PortServer> serve_rtu(const std::filesystem::path& path, const SerialFormat& format) {
  std::error_code error;
  if (std::filesystem::is_character_file(path, error))
    return std::make_unique<RtuServer>(std::make_unique<PortLink>(PortName{false, path.string(), 0}, format),
                                       "rtu:" + path.generic_string(), format, false);
  if (std::filesystem::exists(std::filesystem::symlink_status(path, error)))
    throw Error({path.generic_string(), "is there already, and is no terminal", "left by an emulator that was killed, or another file",
                 "remove it or choose another path"},
                ExitCode::usage);
  return std::make_unique<RtuServer>(std::make_unique<PseudoTerminal>(path), "rtu:" + path.generic_string(), format, true);
}

std::unique_ptr<PortServer> serve_tcp(int port) { return std::make_unique<TcpServer>(port); }

}  // namespace rotorloop::modbus
