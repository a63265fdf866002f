#include "host/bus/live/slcan_port.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <utility>

#include "host/base/error.hpp"
#include "host/bus/live/live_clock.hpp"

namespace rotorloop {
namespace {

constexpr std::array<std::pair<long, speed_t>, 10> kBauds{{{9600, B9600},
                                                           {57600, B57600},
                                                           {115200, B115200},
                                                           {230400, B230400},
                                                           {460800, B460800},
                                                           {500000, B500000},
                                                           {921600, B921600},
                                                           {1000000, B1000000},
                                                           {2000000, B2000000},
                                                           {3000000, B3000000}}};
constexpr std::int64_t kQuiet_ns = 50'000'000;                    // silence that ends the rest of an earlier conversation
constexpr std::int64_t kQuestion_ns = 1'000'000'000;              // between two questions for the error state
constexpr unsigned kFlagReceiveFull = 0x01, kFlagPassive = 0x20;  // of the answer to F

[[noreturn]] void fail_with_device(const std::string& device, std::string what, std::string likely, std::string remedy) {
  throw Error({.where = "slcan:" + device, .what = std::move(what), .likely = std::move(likely), .remedy = std::move(remedy)},
              ExitCode::device);
}

long positive_number(std::string_view text, const std::string& where, const char* meaning) {
  long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value <= 0) {
    throw Error({.where = where,
                 .what = std::string(meaning) + " \"" + std::string(text) + "\" is no number above 0",
                 .likely = "",
                 .remedy = "write slcan:/dev/ttyACM0@1000000 (bits per second of the CAN bus), or @1000000,921600 with the serial line's"});
  }
  return value;
}

int open_serial(const SlcanSettings& s) {
  const int descriptor = ::open(s.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) {
    const int reason = errno;
    fail_with_device(
        s.device, std::string("cannot open the serial port: ") + std::strerror(reason),
        reason == ENOENT   ? "the adapter is not plugged in, or has another name"
        : reason == EACCES ? "this user may not use serial ports"
                           : "",
        reason == EACCES ? "add the user to the group that owns the device (ls -l), often dialout" : "list ports with: ls /dev/tty*");
  }
  termios settings{};
  if (::tcgetattr(descriptor, &settings) != 0) {
    ::close(descriptor);
    fail_with_device(s.device, "this is no serial port", "", "give the device of the adapter, for example /dev/ttyACM0");
  }
  ::ioctl(descriptor, TIOCEXCL);
  ::cfmakeraw(&settings);
  settings.c_cflag |= static_cast<tcflag_t>(CLOCAL | CREAD);
  for (const auto& [baud, code] : kBauds) {
    if (baud != s.baud) continue;
    ::cfsetispeed(&settings, code);
    ::cfsetospeed(&settings, code);
  }
  ::tcsetattr(descriptor, TCSANOW, &settings);
  return descriptor;
}

}  // namespace

SlcanSettings parse_slcan_settings(const std::string& text, const std::string& where) {
  SlcanSettings s;
  const std::size_t at = text.rfind('@');
  s.device = text.substr(0, at);
  if (s.device.empty())
    throw Error({where, "slcan: names no device", "", "write slcan:/dev/ttyACM0, with @BITRATE behind it for another rate than 1000000"});
  if (at == std::string::npos) return s;
  const std::string_view rates = std::string_view(text).substr(at + 1);
  const std::size_t comma = rates.find(',');
  s.bit_rate_Hz = positive_number(rates.substr(0, comma), where, "bit rate");
  if (!slcan_rate_code(s.bit_rate_Hz))
    throw Error({where, "bit rate of " + std::to_string(s.bit_rate_Hz) + " bit/s is none that SLCAN has", "",
                 "use 10000, 20000, 50000, 100000, 125000, 250000, 500000, 800000 or 1000000 (DroneCAN: 1000000)"});
  if (comma == std::string_view::npos) return s;
  s.baud = positive_number(rates.substr(comma + 1), where, "baud rate");
  for (const auto& [baud, code] : kBauds) {
    if (baud == s.baud) return s;
  }
  throw Error({where, "serial line at " + std::to_string(s.baud) + " baud is not supported", "",
               "use 9600, 57600, 115200, 230400, 460800, 500000, 921600, 1000000, 2000000 or 3000000"});
}

SlcanPort::SlcanPort(const SlcanSettings& settings) : settings_(settings), stream_(open_serial(settings)) { open_channel(); }

SlcanPort::~SlcanPort() { stream_.write("C\r"); }

// Reads away what an earlier user left, until the line is quiet.
void SlcanPort::drain() {
  const std::int64_t deadline_ns = live_now_ns() + settings_.answer_ns;
  std::int64_t quiet_ns = live_now_ns() + kQuiet_ns;
  while (live_now_ns() < std::min(quiet_ns, deadline_ns)) {
    if (stream_.next_line()) {
      quiet_ns = live_now_ns() + kQuiet_ns;
    } else if (stream_.gone()) {
      return;
    } else {
      wait_until(std::min(quiet_ns, deadline_ns));
    }
  }
}

SlcanPort::Answer SlcanPort::command(const std::string& text) {
  stream_.write(text + kSlcanEnd);
  const std::int64_t deadline_ns = live_now_ns() + settings_.answer_ns;
  while (true) {
    while (const auto line = stream_.next_line()) {
      if (*line == std::string(1, kSlcanError)) return Answer::error;
      BusFrame frame;
      if (parse_slcan(*line, frame) == SlcanContent::other) return Answer::ok;
    }
    if (live_now_ns() >= deadline_ns || stream_.gone()) return Answer::none;
    wait_until(deadline_ns);
  }
}

void SlcanPort::open_channel() {
  stream_.write("\r\rC\r");  // ends a half-written line; closes a channel that someone left open
  drain();
  const std::string rate = "S" + std::to_string(slcan_rate_code(settings_.bit_rate_Hz).value_or(8));
  if (command(rate) == Answer::error)
    fail_with_device(settings_.device, "the adapter refuses " + std::to_string(settings_.bit_rate_Hz) + " bit/s (" + rate + ")", "",
                     "use a rate that it has, as in slcan:" + settings_.device + "@500000");
  switch (command("O")) {
    case Answer::ok:
      return;
    case Answer::error:
      fail_with_device(settings_.device, "the adapter refuses to open the channel", "another program has it open, or it is bus-off",
                       "close the other program, unplug the adapter and plug it in again");
    case Answer::none:
      fail_with_device(settings_.device, "no answer within " + std::to_string(settings_.answer_ns / 1'000'000) + " ms",
                       "this port is no SLCAN adapter, or the serial line has another speed",
                       "give the speed as slcan:" + settings_.device + "@1000000,115200");
  }
}

SendStatus SlcanPort::send_any(const BusFrame& frame) {
  if (stream_.write(format_slcan(frame) + kSlcanEnd)) {
    ++counted_.sent;
    return SendStatus::queued;
  }
  ++counted_.dropped_tx;
  return SendStatus::queue_full;
}

void SlcanPort::on_answer(const std::string& line) {
  if (line == std::string(1, kSlcanError)) {
    ++link_.refused_by_peer;
  } else if (line.size() == 3 && line[0] == 'F') {
    unsigned flags = 0;
    if (std::from_chars(line.data() + 1, line.data() + 3, flags, 16).ec != std::errc{}) return;
    state_ = (flags & kFlagPassive) != 0 ? BusState::error_passive : BusState::error_active;
    if ((flags & kFlagReceiveFull) != 0) ++counted_.dropped_rx;  // at least one
  }
}

std::optional<StampedBusFrame> SlcanPort::receive_any() {
  if (live_now_ns() >= next_question_ns_) {
    next_question_ns_ = live_now_ns() + kQuestion_ns;
    stream_.write("F\r");
  }
  while (const auto line = stream_.next_line()) {
    StampedBusFrame received;
    received.time_ns = live_now_ns();
    switch (parse_slcan(*line, received.frame)) {
      case SlcanContent::other:
        on_answer(*line);
        continue;
      case SlcanContent::malformed:
        ++link_.malformed;
        continue;
      case SlcanContent::remote:
        ++link_.remote;
        continue;
      case SlcanContent::frame:
        break;
    }
    if (!wanted(received.frame.id, received.frame.extended)) {
      ++counted_.filtered;
      continue;
    }
    ++counted_.received;
    return received;
  }
  if (stream_.gone())
    fail_with_device(settings_.device, "the serial port is gone", "the adapter was unplugged", "plug it in and start again");
  return std::nullopt;
}

std::int64_t SlcanPort::now_ns() const { return live_now_ns(); }

void SlcanPort::wait_until(std::int64_t deadline_ns) {
  TimedBus* const alone = this;
  wait_for_any({&alone, 1}, deadline_ns);
}

LinkCounters SlcanPort::link_counters() const {
  LinkCounters counters = link_;
  counters.malformed += stream_.overlong();
  counters.fd_passed_over = fd_passed_over_;
  return counters;
}

}  // namespace rotorloop
