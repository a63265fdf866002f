// Sends a recording as it was recorded, or faster or slower. What turns motors is left out unless it is asked for: a recording of a flight
// spins the propellers of whatever bus it is played on.
#pragma once
#include <cstdint>
#include <optional>

#include "host/bus/logged_frames.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop::tools {

struct ReplayOptions {
  double pace = 1.0;           // 2: twice as fast
  bool with_commands = false;  // esc.RawCommand, esc.RPMCommand, ArmingStatus, set-points of the fast channel
};

struct ReplayCounters {
  std::uint64_t sent = 0, refused = 0, commands_left_out = 0;
  std::int64_t latest_ns = 0;  // how late the latest frame left
};

class Replay {
 public:
  // `log` must outlive it and have its frames in order of time; begins at `start_ns` of the bus's clock.
  Replay(const BusLog& log, const ReplayOptions& options, std::int64_t start_ns) : log_(log), options_(options), start_ns_(start_ns) {}

  // Sends what is due. Returns when the next frame is due, or none at the end.
  std::optional<std::int64_t> step(TimedBus& bus);
  const ReplayCounters& counters() const { return counters_; }

 private:
  const BusLog& log_;
  ReplayOptions options_;
  std::int64_t start_ns_;
  std::size_t next_ = 0;
  ReplayCounters counters_;
};

}  // namespace rotorloop::tools
