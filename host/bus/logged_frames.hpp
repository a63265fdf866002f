// A recorded bus in memory, whatever file it came from, for replay and for tables. Remote frames, which no node of DroneCAN uses, and what
// is no frame (error reports of an adapter) are left out and counted, so that foreign recordings can be read.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "host/bus/bus_frame.hpp"

namespace rotorloop {

struct LoggedFrame {
  std::int64_t time_ns = 0;     // since 1970, or since the start of a virtual run; candump text holds microseconds only
  std::uint16_t interface = 0;  // index into BusLog::interfaces
  BusFrame frame;
};

struct BusLog {
  std::vector<LoggedFrame> frames;      // in the order of the file
  std::vector<std::string> interfaces;  // "can0", …; one empty name for pcap, which has none
  std::uint64_t skipped_remote = 0;
  std::uint64_t skipped_error = 0;
  std::vector<std::string> notes;  // what was tolerated, in words
};

}  // namespace rotorloop
