// SLCAN, the text protocol of serial CAN adapters (Lawicel), without a serial port: lines of bytes to frames and back.
//   tIIILDD…  11-bit identifier, TIIIIIIIILDD…  29-bit, d/D the same as CAN FD, b/B as CAN FD with the higher data rate;
//   r/R remote frames; L is the length code (9..F: 12 to 64 bytes); up to 4 more hex digits are a time stamp in ms.
// Sources: Lawicel CAN232 manual v3; the FD letters as CANable 2 firmware has them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "host/bus/bus_frame.hpp"

namespace rotorloop {

inline constexpr char kSlcanEnd = '\r', kSlcanError = '\a';

// One line without its end.
std::string format_slcan(const BusFrame& frame);

enum class SlcanContent : std::uint8_t { frame, remote, other, malformed };

// `other`: no frame at all (an answer, a command). Fills `frame` when the answer is `frame`.
SlcanContent parse_slcan(std::string_view line, BusFrame& frame);

// Cuts a stream into lines. An error byte is a line of its own ("\a"). What is longer than any line is thrown away and counted.
class SlcanLines {
 public:
  void add(std::string_view bytes) { buffer_ += bytes; }
  std::optional<std::string> next();
  std::uint64_t overlong() const { return overlong_; }

 private:
  static constexpr std::size_t kLongest = 1 + 8 + 1 + 128 + 4;
  std::string buffer_;
  std::uint64_t overlong_ = 0;
};

// The bit rates that S0 to S8 stand for; none for any other.
std::optional<int> slcan_rate_code(long bit_rate_Hz);

}  // namespace rotorloop
