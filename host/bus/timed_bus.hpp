// A bus with a clock on which one can wait: what tools and processes use. Nodes in lockstep get the CanBus below it, which has
// neither. Backends: live/ (UDP multicast, SLCAN, SocketCAN, gs_usb) in real time, sim/world/lockstep_bus.hpp in virtual time.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "host/bus/bus_frame.hpp"
#include "host/bus/can_bus.hpp"

namespace rotorloop {

// What a live backend met beside frames; PortCounters has the frames.
struct LinkCounters {
  std::uint64_t malformed = 0;         // wrong magic, CRC, length, digits: no frame could be made of it
  std::uint64_t remote = 0;            // remote frames: no node of DroneCAN uses them; passed over
  std::uint64_t error_reports = 0;     // an adapter reporting bus errors
  std::uint64_t own_echo = 0;          // own frames that came back (multicast)
  std::uint64_t fd_passed_over = 0;    // FD frames at a reader of classic frames
  std::uint64_t refused_by_peer = 0;   // sent, and answered by an error (SLCAN)
  std::uint64_t receive_buffer_B = 0;  // that the system granted; 0: not known
  std::uint64_t no_buffer = 0;         // the system's queue was full; the frame was tried again (SocketCAN)
  std::uint64_t stale = 0;             // dropped, as they had waited too long to be sent; in dropped_tx too
  std::uint64_t fd_refused = 0;        // FD frames not sent, as the interface is classic; in dropped_tx too
  std::uint64_t unconfirmed = 0;       // taken by the system, and not seen on the bus yet; on their way, or lost with the interface
};

class TimedBus : public CanBus {
 public:
  // Frames of both formats, in bus order.
  virtual SendStatus send_any(const BusFrame& frame) = 0;
  virtual std::optional<StampedBusFrame> receive_any() = 0;

  // Nanoseconds since 1970 on a live bus, since the start of the run on a virtual one; never runs backwards.
  virtual std::int64_t now_ns() const = 0;
  // Returns when a frame can be received, at the deadline, or earlier for no reason (a signal); sends meanwhile what is queued.
  virtual void wait_until(std::int64_t deadline_ns) = 0;
  // The next frame, or none by the deadline.
  std::optional<StampedBusFrame> receive_until(std::int64_t deadline_ns);

  virtual LinkCounters link_counters() const { return {}; }
  virtual std::string name() const = 0;  // as the user wrote it
  // Where a program finds a bus that is offered to it: "/dev/pts/4" of an SLCAN server. Empty for all others.
  virtual std::string device_for_programs() const { return {}; }
  // What to poll for input; -1: only wait_until() can wait.
  virtual int descriptor() const { return -1; }
  // Bytes are queued that the system did not take yet: poll for output too and call flush().
  virtual bool output_waits() const { return false; }
  virtual void flush() {}
  // When flush() has something to try again though polling for output says nothing of it (a full queue of SocketCAN); INT64_MAX: never.
  virtual std::int64_t next_flush_ns() const { return INT64_MAX; }
  // Frames were taken from the system and not received yet: polling says nothing of them.
  virtual bool input_waits() const { return false; }
  // What changed on the bus (bus-off, nobody acknowledges), once a change, as a sentence for people; none: nothing new.
  virtual std::optional<std::string> next_notice() { return std::nullopt; }

  SendStatus send(const CanFrame& frame) final { return send_any(BusFrame(frame)); }
  // The next classic frame; FD frames before it are passed over and counted.
  std::optional<StampedFrame> receive() final;

 protected:
  std::uint64_t fd_passed_over_ = 0;
};

}  // namespace rotorloop
