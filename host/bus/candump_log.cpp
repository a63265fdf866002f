// Formatting by hand: a recorder runs for every frame of a lockstep run, and printf would cost more than the bus.
#include "host/bus/candump_log.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "host/base/error.hpp"

namespace rotorloop {
namespace {

constexpr std::array<char, 16> kHex{'0', '1', '2', '3', '4', '5', '6', '7', '8', '9', 'A', 'B', 'C', 'D', 'E', 'F'};

constexpr auto kHexPairs = [] {
  std::array<std::array<char, 2>, 256> pairs{};
  for (std::size_t i = 0; i < 256; ++i) pairs[i] = {kHex[i >> 4], kHex[i & 15]};
  return pairs;
}();

// `digits` decimal digits ending just before `end`; more significant ones are lost.
void put_decimal(char* end, std::uint64_t value, int digits) {
  for (int i = 0; i < digits; ++i, value /= 10) *--end = static_cast<char>('0' + value % 10);
}

constexpr std::uint32_t kErrorFlag = 0x20000000;  // of the 8-digit identifiers: adapter report instead of a frame

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

// Reads one line; holds the position for messages.
class LineParser {
 public:
  LineParser(std::string_view line, const std::string& name, std::size_t number) : rest_(line), line_(line), name_(name), number_(number) {}

  std::int64_t time_ns() {
    blanks();
    expect('(', "a time stamp \"(seconds.microseconds)\"");
    const std::int64_t seconds = decimal(1, 12);
    expect('.', "microseconds after the seconds");
    const std::int64_t micros = decimal(6, 6);
    expect(')', "the end of the time stamp");
    return (seconds * 1'000'000 + micros) * 1'000;
  }
  std::string_view interface() {
    blanks();
    const std::size_t length = std::min(rest_.find(' '), rest_.size());
    if (length == 0 || length == rest_.size()) fail("expected an interface name and a frame");
    const std::string_view word = rest_.substr(0, length);
    rest_.remove_prefix(length);
    blanks();
    return word;
  }
  // "RX B -" of `candump -x`: direction, bit rate switch, error state of the sender. True: the bit rate was switched.
  bool direction_and_flags() {
    if (!rest_.starts_with("RX ") && !rest_.starts_with("TX ")) return false;
    const bool fast = rest_.substr(2).starts_with(" B");
    if (rest_.size() < 8) fail("expected flags and a frame behind the direction");
    rest_.remove_prefix(7);
    blanks();
    return fast;
  }
  std::uint32_t identifier(std::size_t& digits) {
    std::uint32_t id = 0;
    digits = 0;
    while (!rest_.empty() && hex_value(rest_.front()) >= 0 && digits < 9) {
      id = (id << 4) | static_cast<std::uint32_t>(hex_value(rest_.front()));
      rest_.remove_prefix(1);
      ++digits;
    }
    return id;
  }
  // "[8]  11 22 …" behind an identifier, as candump prints it on a screen. False: it is the form of -L.
  bool on_screen(BusFrame& frame, bool& remote) {
    if (rest_.empty() || rest_.front() != ' ') {
      expect('#', "\"#\" after the identifier");
      return false;
    }
    blanks();
    expect('[', "\"#\" or \"[length]\" after the identifier");
    const bool two_digits = rest_.size() > 2 && rest_[1] != ']';  // of CAN FD
    const std::int64_t length = decimal(1, 2);
    frame.fd = two_digits;
    expect(']', "\"]\" after the length");
    blanks();
    remote = rest_.starts_with("remote request");
    for (std::int64_t i = 0; i < length && !remote; ++i, blanks()) {
      if (rest_.size() < 2 || hex_value(rest_[0]) < 0 || hex_value(rest_[1]) < 0 || frame.length >= (frame.fd ? 64 : 8))
        fail("expected " + std::to_string(length) + " pairs of hex digits as data");
      frame.data[frame.length++] = static_cast<std::uint8_t>(hex_value(rest_[0]) << 4 | hex_value(rest_[1]));
      rest_.remove_prefix(2);
    }
    return true;
  }
  // The digit of flags of a CAN FD frame (canfd_frame.flags): 1 higher data rate, 2 sender error-passive.
  bool bit_rate_switch() {
    const int flags = rest_.empty() ? -1 : hex_value(rest_.front());
    if (flags < 0) fail("expected a digit of flags after \"##\"");
    rest_.remove_prefix(1);
    return (flags & 1) != 0;
  }
  bool take(char c) {
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void data(BusFrame& frame) {
    const std::size_t most = frame.fd ? 64 : 8;
    while (!rest_.empty() && rest_.front() != ' ') {
      if (take('.')) continue;  // old can-utils wrote dots between bytes
      if (take('_')) {          // raw length code 9..F of an 8-byte frame: says nothing about the content
        if (rest_.empty() || hex_value(rest_.front()) < 0) fail("expected a length code after \"_\"");
        rest_.remove_prefix(1);
        continue;
      }
      if (rest_.size() < 2 || hex_value(rest_[0]) < 0 || hex_value(rest_[1]) < 0) fail("expected pairs of hex digits as data");
      if (frame.length == most) fail(frame.fd ? "more than 64 data bytes in a CAN FD frame" : "more than 8 data bytes in a classic frame");
      frame.data[frame.length++] = static_cast<std::uint8_t>(hex_value(rest_[0]) << 4 | hex_value(rest_[1]));
      rest_.remove_prefix(2);
    }
    if (!possible_length(frame.fd, frame.length)) fail(std::to_string(frame.length) + " data bytes, which no CAN FD frame has");
    blanks();
    if (!rest_.empty() && rest_ != "R" && rest_ != "T") fail("unexpected text after the frame");  // direction, as candump -x writes it
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error({.where = name_ + ":" + std::to_string(number_),
                 .what = what + ", found \"" + std::string(line_.substr(0, 80)) + "\"",
                 .likely = "the file is not a log of `candump -L`, or was cut",
                 .remedy = "record with candump -L, or convert with asc2log"});
  }

 private:
  void blanks() {
    while (take(' ')) {
    }
  }
  void expect(char c, const char* meaning) {
    if (!take(c)) fail(std::string("expected ") + meaning);
  }
  std::int64_t decimal(std::size_t min_digits, std::size_t max_digits) {
    std::int64_t value = 0;
    std::size_t digits = 0;
    for (; !rest_.empty() && rest_.front() >= '0' && rest_.front() <= '9' && digits < max_digits; ++digits) {
      value = value * 10 + (rest_.front() - '0');
      rest_.remove_prefix(1);
    }
    if (digits < min_digits) fail("expected " + std::to_string(min_digits) + " or more decimal digits in the time stamp");
    return value;
  }

  std::string_view rest_;
  std::string_view line_;
  const std::string& name_;
  std::size_t number_;
};

std::uint16_t interface_index(BusLog& log, std::string_view name) {
  for (std::size_t i = 0; i < log.interfaces.size(); ++i) {
    if (log.interfaces[i] == name) return static_cast<std::uint16_t>(i);
  }
  log.interfaces.emplace_back(name);
  return static_cast<std::uint16_t>(log.interfaces.size() - 1);
}

// Stamps of all lines, of frames that are left out too: they may be the time since the line before.
struct Stamps {
  std::vector<std::int64_t> time_ns;
  std::vector<std::size_t> of_frame;  // the line of each frame, as an index into `time_ns`

  // Clocks that tell a time are set back once in a while; the time since the line before falls as often as it rises.
  bool since_the_line_before() const {
    constexpr std::size_t kLeast = 2, kShare = 10;
    std::size_t back = 0;
    for (std::size_t i = 1; i < time_ns.size(); ++i) back += time_ns[i] < time_ns[i - 1];
    return back >= kLeast && kShare * back > time_ns.size();
  }
};

void add_up(Stamps stamps, BusLog& log) {
  std::partial_sum(stamps.time_ns.begin(), stamps.time_ns.end(), stamps.time_ns.begin());
  for (std::size_t i = 0; i < log.frames.size(); ++i) log.frames[i].time_ns = stamps.time_ns[stamps.of_frame[i]];
  log.notes.emplace_back("its stamps fall as often as they rise: read as the time since the line before (candump -td), and added up");
}

// `ended`: the line had its line feed. Without it the form of -L, which tells no length, is whole for certain only when it is full.
void parse_line(LineParser line, bool ended, BusLog& log, Stamps& stamps) {
  LoggedFrame entry;
  entry.time_ns = line.time_ns();
  stamps.time_ns.push_back(entry.time_ns);
  entry.interface = interface_index(log, line.interface());
  const bool fast = line.direction_and_flags();
  std::size_t digits = 0;
  const std::uint32_t id = line.identifier(digits);
  if (digits != 3 && digits != 8) line.fail("expected an identifier of 3 or 8 hex digits");
  bool remote = false;
  const bool on_screen = line.on_screen(entry.frame, remote);
  if (!on_screen) entry.frame.fd = line.take('#');
  if (entry.frame.fd && !on_screen) entry.frame.bit_rate_switch = line.bit_rate_switch();
  if (remote || (!on_screen && !entry.frame.fd && line.take('R'))) {
    ++log.skipped_remote;
    return;
  }
  if (digits == 8 && (id & kErrorFlag) != 0) {
    ++log.skipped_error;
    return;
  }
  entry.frame.extended = digits == 8;
  entry.frame.bit_rate_switch = entry.frame.bit_rate_switch || fast;
  entry.frame.id = id;
  if (id >= (entry.frame.extended ? 1u << 29 : 1u << 11)) line.fail("identifier beyond 7FF (3 digits) or 1FFFFFFF (8 digits)");
  if (!on_screen) line.data(entry.frame);
  if (!ended && !on_screen && entry.frame.length < (entry.frame.fd ? 64 : 8)) line.fail("a short frame without the end of its line");
  log.frames.push_back(entry);
  stamps.of_frame.push_back(stamps.time_ns.size() - 1);
}

char* put_line_start(char* p, std::int64_t time_ns, std::string_view interface, std::uint32_t id, bool extended) {
  const auto micros = static_cast<std::uint64_t>(time_ns) / 1'000;
  *p++ = '(';
  put_decimal(p + 10, micros / 1'000'000, 10);
  p += 10;
  *p++ = '.';
  put_decimal(p + 6, micros % 1'000'000, 6);
  p += 6;
  *p++ = ')';
  *p++ = ' ';
  std::memcpy(p, interface.data(), interface.size());
  p += interface.size();
  *p++ = ' ';
  for (int nibble = extended ? 7 : 2; nibble >= 0; --nibble) *p++ = kHex[(id >> (4 * nibble)) & 15u];
  return p;
}

std::size_t put_data(const char* begin, char* p, std::span<const std::uint8_t> data) {
  for (const std::uint8_t byte : data) {
    std::memcpy(p, kHexPairs[byte].data(), 2);
    p += 2;
  }
  *p++ = '\n';
  return static_cast<std::size_t>(p - begin);
}

}  // namespace

std::size_t format_candump(char* out, std::int64_t time_ns, std::string_view interface, const CanFrame& frame) {
  char* p = put_line_start(out, time_ns, interface, frame.id, frame.extended);
  *p++ = '#';
  return put_data(out, p, {frame.data.data(), frame.length});
}

std::size_t format_candump(char* out, std::int64_t time_ns, std::string_view interface, const BusFrame& frame) {
  char* p = put_line_start(out, time_ns, interface, frame.id, frame.extended);
  *p++ = '#';
  if (frame.fd) {
    *p++ = '#';
    *p++ = frame.bit_rate_switch ? '1' : '0';
  }
  return put_data(out, p, {frame.data.data(), frame.length});
}

CandumpWriter::CandumpWriter(const std::string& path, std::string interface) : file_(path), interface_(std::move(interface)) {
  if (interface_.empty() || interface_.size() > kMaxInterfaceName || interface_.find_first_of(" \t\n") != std::string::npos) {
    throw Error({.where = path,
                 .what = "interface name \"" + interface_ + "\" in a bus log: 1 to 15 characters without blanks are possible",
                 .likely = "",
                 .remedy = "name it like an interface, for example vcan0"});
  }
}

BusLog parse_candump(std::string_view text, const std::string& name) {
  BusLog log;
  Stamps stamps;
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const bool ended = end < text.size();
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    if (line.empty() || line.front() == '#' || line.front() == ';' || line.front() == '\t') continue;  // tab: what -e says of an error
    try {
      parse_line(LineParser(line, name, number), ended, log, stamps);
    } catch (const Error&) {
      if (ended) throw;
      log.notes.push_back("line " + std::to_string(number) + " was cut off and is left out");
    }
  }
  if (stamps.since_the_line_before()) add_up(std::move(stamps), log);
  return log;
}

}  // namespace rotorloop
