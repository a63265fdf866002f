// One CAN frame as a datagram of the multicast bus that ArduPilot's SITL, AP_Periph, pydronecan and the DroneCAN GUI tool share.
// Little-endian: magic u16, CRC u16 (CRC-16-CCITT-FALSE over all that follows it), flags u16 (bit 0: FD), identifier u32 (bit 31
// extended, 30 remote, 29 error report), data. Source: dronecan/driver/mcast.py of pydronecan 1.0.27, AP_HAL_SITL.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "host/bus/bus_frame.hpp"

namespace rotorloop {

inline constexpr std::size_t kMulticastHeader = 10, kMulticastPacket = kMulticastHeader + 64;
inline constexpr std::uint16_t kMulticastMagic = 0x2934, kMulticastFd = 1;

// Returns the number of bytes written to the front of `out`.
std::size_t encode_multicast(const BusFrame& frame, std::array<std::uint8_t, kMulticastPacket>& out);

enum class MulticastContent : std::uint8_t { frame, remote, error_report, malformed };

// Fills `frame` when the answer is `frame`.
MulticastContent decode_multicast(std::span<const std::uint8_t> packet, BusFrame& frame);

}  // namespace rotorloop
