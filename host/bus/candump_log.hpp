// Bus log as text in the format of `candump -L` (can-utils), which canplayer, log2asc, python-can and SavvyCAN read:
//   (0000000012.345678) can0 140#8813F401          CAN FD: 140##1… with a digit of flags (1: higher data rate) before the data
// Standard identifiers have 3 hex digits, extended ones 8. A virtual run starts at 1970-01-01 00:00:00.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "host/bus/bus_frame.hpp"
#include "host/bus/logged_frames.hpp"
#include "host/bus/output_file.hpp"
#include "protocols/can_frame.hpp"

namespace rotorloop {

inline constexpr std::size_t kMaxInterfaceName = 15;  // IFNAMSIZ - 1

// Writes one line with its newline into `out` (at least 96 bytes) and returns its length. time_ns >= 0; below 1 us is cut off.
std::size_t format_candump(char* out, std::int64_t time_ns, std::string_view interface, const CanFrame& frame);
// The same for either format; at least 224 bytes.
std::size_t format_candump(char* out, std::int64_t time_ns, std::string_view interface, const BusFrame& frame);

class CandumpWriter {
 public:
  // Throws Error if the file cannot be created or the interface name is empty, longer than 15 or contains a blank.
  CandumpWriter(const std::string& path, std::string interface);
  void write(std::int64_t time_ns, const CanFrame& frame) { file_.commit(format_candump(file_.reserve(), time_ns, interface_, frame)); }
  void write(std::int64_t time_ns, const BusFrame& frame) { file_.commit(format_candump(file_.reserve(), time_ns, interface_, frame)); }
  void flush() { file_.flush(); }  // throws Error when the disk refused
  void close() { file_.close(); }  // throws Error when the disk refused

 private:
  OutputFile file_;
  std::string interface_;
};

// Also what candump prints on a screen with -ta or -tz: "(12.345678)  can0  123   [2]  11 22". Lines that begin with "#" or ";" are
// comments; a last line without its end that cannot be read is left out and noted. Throws Error with file and line. `name` is what messages
// call the text.
BusLog parse_candump(std::string_view text, const std::string& name);

}  // namespace rotorloop
