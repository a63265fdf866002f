#include "host/bus/live/slcan_server.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "host/base/error.hpp"
#include "host/bus/live/live_clock.hpp"

namespace rotorloop {
namespace {

constexpr std::string_view kDone = "\r", kRefused = "\a";

int open_terminal(const std::string& link) {
  const int master = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (master < 0 || ::grantpt(master) != 0 || ::unlockpt(master) != 0) {
    const int reason = errno;
    if (master >= 0) ::close(master);
    throw Error({.where = "slcan-server:" + link,
                 .what = std::string("cannot make a pseudo terminal: ") + std::strerror(reason),
                 .likely = "/dev/pts is not mounted",
                 .remedy = "mount it, or use mcast:0"},
                ExitCode::device);
  }
  return master;
}

std::string terminal_of(int master) {
  std::array<char, 128> name{};
  return ::ptsname_r(master, name.data(), name.size()) == 0 ? name.data() : "";
}

// A program that was killed leaves its link behind: one to a terminal that is gone may be replaced.
void make_link(const std::string& link, const std::string& terminal) {
  std::array<char, 256> target{};
  const ssize_t size = ::readlink(link.c_str(), target.data(), target.size() - 1);
  if (size > 0 && std::string_view(target.data()).starts_with("/dev/pts/") && ::access(link.c_str(), F_OK) != 0) ::unlink(link.c_str());
  if (::symlink(terminal.c_str(), link.c_str()) == 0) return;
  const int reason = errno;
  throw Error({.where = "slcan-server:" + link,
               .what = std::string("cannot make the link to the terminal: ") + std::strerror(reason),
               .likely = reason == EEXIST ? "another server runs there, or it is a file" : "",
               .remedy = reason == EEXIST ? "give another path, or remove it" : "check that the folder exists and may be written"},
              ExitCode::device);
}

}  // namespace

SlcanServer::SlcanServer(std::string link) : link_(std::move(link)), stream_(open_terminal(link_)) {
  terminal_ = terminal_of(stream_.descriptor());
  held_ = ::open(terminal_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  termios raw{};
  if (held_ >= 0 && ::tcgetattr(held_, &raw) == 0) {
    ::cfmakeraw(&raw);
    ::tcsetattr(held_, TCSANOW, &raw);
  }
  if (!link_.empty()) {
    try {
      make_link(link_, terminal_);
    } catch (...) {
      ::close(held_);
      throw;
    }
  }
}

SlcanServer::~SlcanServer() {
  if (!link_.empty()) ::unlink(link_.c_str());
  ::close(held_);
}

SendStatus SlcanServer::send_any(const BusFrame& frame) {
  if (!open_) {
    ++counted_.dropped_tx;  // nobody listens
    return SendStatus::queue_full;
  }
  std::string line = format_slcan(frame);
  if (stamps_) {
    constexpr std::string_view kHexDigits = "0123456789ABCDEF";
    const auto ms = static_cast<unsigned>(live_now_ns() / 1'000'000 % 60'000);
    for (int nibble = 3; nibble >= 0; --nibble) line += kHexDigits[ms >> (4 * nibble) & 15u];
  }
  if (stream_.write(line + kSlcanEnd)) {
    ++counted_.sent;
    return SendStatus::queued;
  }
  ++counted_.dropped_tx;
  return SendStatus::queue_full;
}

// Commands that only real hardware needs (bit timing, acceptance code) are accepted and do nothing.
void SlcanServer::on_command(const std::string& line) {
  if (line.empty() || line == std::string(1, kSlcanError)) return answer(kDone);
  switch (line[0]) {
    case 'O':
    case 'L':
      listen_only_ = line[0] == 'L';
      open_ = true;
      return answer(kDone);
    case 'C':
      open_ = false;
      return answer(kDone);
    case 'S':
    case 's':
    case 'Y':
    case 'M':
    case 'm':
      return answer(open_ ? kRefused : kDone);
    case 'Z':
      stamps_ = line == "Z1";
      return answer(kDone);
    case 'F':
      return answer("F00\r");
    case 'V':
      return answer("V1013\r");
    case 'N':
      return answer("NROLO\r");
    default:
      return answer(kRefused);
  }
}

std::optional<StampedBusFrame> SlcanServer::receive_any() {
  while (const auto line = stream_.next_line()) {
    StampedBusFrame received;
    received.time_ns = live_now_ns();
    switch (parse_slcan(*line, received.frame)) {
      case SlcanContent::other:
        on_command(*line);
        continue;
      case SlcanContent::malformed:
        ++link_counted_.malformed;
        answer(kRefused);
        continue;
      case SlcanContent::remote:
        ++link_counted_.remote;
        answer(kRefused);
        continue;
      case SlcanContent::frame:
        break;
    }
    if (!open_ || listen_only_) {
      answer(kRefused);
      continue;
    }
    answer(received.frame.extended ? "Z\r" : "z\r");
    if (!wanted(received.frame.id, received.frame.extended)) {
      ++counted_.filtered;
      continue;
    }
    ++counted_.received;
    return received;
  }
  return std::nullopt;
}

std::int64_t SlcanServer::now_ns() const { return live_now_ns(); }

void SlcanServer::wait_until(std::int64_t deadline_ns) {
  TimedBus* const alone = this;
  wait_for_any({&alone, 1}, deadline_ns);
}

LinkCounters SlcanServer::link_counters() const {
  LinkCounters counters = link_counted_;
  counters.malformed += stream_.overlong();
  counters.fd_passed_over = fd_passed_over_;
  return counters;
}

}  // namespace rotorloop
