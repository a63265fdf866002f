// A node on the virtual bus whose controller is modelled register by register elsewhere: it has buffers, error counters and bus-off of
// its own. The bus asks it at each arbitration and tells it the end of each frame.
#pragma once
#include <cstdint>

#include "protocols/can_frame.hpp"

namespace rotorloop::sim {

// What became of a frame, as a controller sees it.
struct FrameEnd {
  const CanFrame* frame = nullptr;
  std::int64_t start_ns = 0, end_ns = 0;  // of an error: end of its delimiter
  bool own = false;
  bool error = false;
  bool acknowledge_missing = false;  // what the error was
};

class BusController {
 public:
  virtual ~BusController() = default;
  // Since when it has a frame to send and may take part; kNever_ns: neither.
  virtual std::int64_t ready_ns() const = 0;
  // An arbitration begins. The frame with which it takes part, valid until the end of that frame; null: none, it listens.
  virtual const CanFrame* offer(std::int64_t time_ns) = 0;
  virtual void on_start(std::int64_t time_ns, bool own) = 0;
  virtual void on_end(const FrameEnd& end) = 0;
  // Takes part in acknowledging at this time: on the bus, and not silent.
  virtual bool acknowledges(std::int64_t time_ns) const = 0;
  virtual bool takes_own_acknowledge() const = 0;  // loop back: goes on without another node
  virtual bool passive() const = 0;
  // Does it read a bus of this bit time? If not, what it sends is destroyed, and what it hears when it is error active.
  virtual bool in_time(std::int64_t bit_ns) const = 0;
};

}  // namespace rotorloop::sim
