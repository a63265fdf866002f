#include "host/bus/live/slcan_line.hpp"

#include <array>
#include <cctype>

namespace rotorloop {
namespace {

constexpr std::string_view kSlcanHex = "0123456789ABCDEF";
constexpr std::array<long, 9> kSlcanRates_Hz{10'000, 20'000, 50'000, 100'000, 125'000, 250'000, 500'000, 800'000, 1'000'000};

int digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

std::optional<std::uint32_t> hex(std::string_view digits) {
  std::uint32_t value = 0;
  for (const char c : digits) {
    if (digit(c) < 0) return std::nullopt;
    value = value << 4 | static_cast<std::uint32_t>(digit(c));
  }
  return value;
}

std::uint8_t length_code(std::uint8_t length) {
  for (std::size_t i = 0; i < kFdLengths.size(); ++i) {
    if (kFdLengths[i] == length) return static_cast<std::uint8_t>(9 + i);
  }
  return length;
}

}  // namespace

std::string format_slcan(const BusFrame& frame) {
  const char letter = !frame.fd ? 't' : frame.bit_rate_switch ? 'b' : 'd';
  std::string line(1, frame.extended ? static_cast<char>(std::toupper(letter)) : letter);
  for (int nibble = frame.extended ? 7 : 2; nibble >= 0; --nibble) line += kSlcanHex[frame.id >> (4 * nibble) & 15u];
  line += kSlcanHex[length_code(frame.length)];
  for (std::size_t i = 0; i < frame.length; ++i) {
    line += kSlcanHex[frame.data[i] >> 4];
    line += kSlcanHex[frame.data[i] & 15u];
  }
  return line;
}

SlcanContent parse_slcan(std::string_view line, BusFrame& frame) {
  if (line.empty()) return SlcanContent::other;
  const char letter = line.front();
  const char kind = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  if (std::string_view("tdbr").find(kind) == std::string_view::npos) return SlcanContent::other;
  frame = {};
  frame.extended = letter != kind;
  frame.fd = kind == 'd' || kind == 'b';
  frame.bit_rate_switch = kind == 'b';
  const std::size_t digits = frame.extended ? 8 : 3;
  if (line.size() < 1 + digits + 1) return SlcanContent::malformed;
  const auto id = hex(line.substr(1, digits));
  const int code = digit(line[1 + digits]);
  if (!id || code < 0 || (!frame.fd && code > 8)) return SlcanContent::malformed;
  if (kind == 'r') return SlcanContent::remote;
  frame.id = *id;
  frame.length = static_cast<std::uint8_t>(code <= 8 ? code : kFdLengths[static_cast<std::size_t>(code - 9)]);
  const std::string_view rest = line.substr(2 + digits);
  const std::size_t bytes = 2 * std::size_t{frame.length};
  if (rest.size() != bytes && rest.size() != bytes + 4) return SlcanContent::malformed;
  for (std::size_t i = 0; i < frame.length; ++i) {
    const auto byte = hex(rest.substr(2 * i, 2));
    if (!byte) return SlcanContent::malformed;
    frame.data[i] = static_cast<std::uint8_t>(*byte);
  }
  if (!hex(rest.substr(bytes))) return SlcanContent::malformed;
  return possible(frame) ? SlcanContent::frame : SlcanContent::malformed;
}

std::optional<std::string> SlcanLines::next() {
  const std::size_t end = buffer_.find_first_of(std::string{kSlcanEnd, kSlcanError});
  if (end == std::string::npos) {
    if (buffer_.size() > kLongest) {
      ++overlong_;
      buffer_.clear();
    }
    return std::nullopt;
  }
  // An error byte answers by itself; what stands before it is the rest of a line that the adapter gave up.
  std::string line = buffer_[end] == kSlcanError ? std::string(1, kSlcanError) : buffer_.substr(0, end);
  buffer_.erase(0, end + 1);
  if (line.size() > kLongest) {
    ++overlong_;
    return next();
  }
  return line;
}

std::optional<int> slcan_rate_code(long bit_rate_Hz) {
  for (std::size_t i = 0; i < kSlcanRates_Hz.size(); ++i) {
    if (kSlcanRates_Hz[i] == bit_rate_Hz) return static_cast<int>(i);
  }
  return std::nullopt;
}

}  // namespace rotorloop
