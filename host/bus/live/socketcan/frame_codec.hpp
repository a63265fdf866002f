// A frame as Linux has it (linux/can.h): struct can_frame of 16 bytes for classic CAN, struct canfd_frame of 72 for CAN FD. Pure.
#pragma once
#include <linux/can.h>

#include <cstddef>
#include <cstdint>

#include "host/bus/bus_frame.hpp"
#include "protocols/can_controller.hpp"

namespace rotorloop {

enum class SocketCanContent : std::uint8_t { frame, remote, error_report, malformed };

// `bytes`: how many of `raw` the system filled. `frame` is set when a frame is returned.
SocketCanContent decode_socketcan(const canfd_frame& raw, std::size_t bytes, BusFrame& frame);
// Returns the bytes to send. `frame` must be possible().
std::size_t encode_socketcan(const BusFrame& frame, canfd_frame& raw);
// A filter for the kernel: the format counts; data and remote frames pass.
can_filter kernel_filter(const CanFilter& filter);

}  // namespace rotorloop
