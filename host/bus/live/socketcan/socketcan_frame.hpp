// Frames and error reports of Linux's raw CAN sockets (linux/can.h, linux/can/error.h; Documentation/networking/can.rst), without a socket.
#pragma once
#include <linux/can.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "host/bus/bus_frame.hpp"
#include "protocols/can_controller.hpp"

namespace rotorloop {

// Written to a raw socket: CAN_MTU bytes of a classic frame, CANFD_MTU of an FD frame.
struct SocketCanFrame {
  canfd_frame raw{};
  std::size_t size = 0;
};
SocketCanFrame to_socketcan(const BusFrame& frame);

enum class SocketCanContent : std::uint8_t { frame, remote, error_report, malformed };
// What was read from a raw socket; `out` is set for frames.
SocketCanContent from_socketcan(std::span<const std::uint8_t> bytes, BusFrame& out);

// One error frame of the kernel. What a driver does not report stays empty.
struct BusErrorReport {
  std::optional<BusState> state;    // that the controller came to
  bool restarted = false;           // after bus-off
  bool no_acknowledge = false;      // nobody else on the bus, or another bit rate
  bool lost_arbitration = false;    // normal on a busy bus
  bool receive_overflow = false;    // of the controller: a frame at least was lost
  bool protocol = false;            // a bit, stuff, form or CRC error was seen
  std::optional<int> sent_errors;   // transmit error counter
  std::optional<int> heard_errors;  // receive error counter
};
BusErrorReport error_report(const can_frame& frame);
// "bus-off", "error passive, nobody acknowledges": for a message.
std::string words(const BusErrorReport& report);

}  // namespace rotorloop
