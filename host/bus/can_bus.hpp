// The bus contract: what every backend (virtual, SocketCAN, gs_usb, …) offers to a node. One object is one node's port.
// A port never blocks. send() queues: frames leave in CAN priority order, frames of equal id in the order they were sent
// (DroneCAN multi-frame transfers need that). receive() returns frames of other nodes in bus order, never one's own.
#pragma once
#include <cstdint>
#include <optional>

#include "protocols/can_frame.hpp"

namespace rotorloop {

struct StampedFrame {
  CanFrame frame;
  std::int64_t time_ns = 0;  // end of frame on the bus, on the port's clock
};

enum class SendStatus : std::uint8_t {
  queued,
  queue_full,  // dropped; counted
  bus_off,     // dropped; counted
};

enum class BusState : std::uint8_t { error_active, error_passive, bus_off };

struct PortCounters {
  std::uint64_t sent = 0;           // frames that reached the bus
  std::uint64_t received = 0;
  std::uint64_t dropped_tx = 0;     // queue full or bus off
  std::uint64_t dropped_rx = 0;     // receive queue full: the node is too slow
  std::uint64_t error_frames = 0;   // seen while this port transmitted
};

class CanBus {
 public:
  virtual ~CanBus() = default;
  virtual SendStatus send(const CanFrame& frame) = 0;
  virtual std::optional<StampedFrame> receive() = 0;
  virtual BusState state() const = 0;
  virtual PortCounters counters() const = 0;
};

}  // namespace rotorloop
