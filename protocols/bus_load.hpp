// What a frame costs on the wire, and who wins the bus: the arithmetic behind every load figure of docs/wire.md.
#pragma once
#include <cstdint>

#include "protocols/can_frame.hpp"

namespace rotorloop::protocols {

// Worst-case bits of a classic data frame: SOF to CRC with the most stuff bits that can occur, then CRC delimiter,
// acknowledge, end of frame and the 3 bits of intermission. 80 + 10 per byte (29-bit id), 55 + 10 per byte (11-bit id).
// Source: ISO 11898-1 frame format; stuffed length n + floor((n - 1) / 4).
constexpr std::uint32_t worst_frame_bits(bool extended, std::uint32_t data_bytes) {
  const std::uint32_t stuffable = (extended ? 54u : 34u) + 8u * data_bytes;
  return stuffable + (stuffable - 1u) / 4u + 13u;
}

// Frames of a DroneCAN transfer (classic CAN): 7 payload bytes each, 2 CRC bytes in front from 8 bytes on.
constexpr std::uint32_t transfer_frames(std::uint32_t payload_bytes) { return payload_bytes <= 7u ? 1u : (payload_bytes + 2u + 6u) / 7u; }

constexpr std::uint32_t worst_transfer_bits(std::uint32_t payload_bytes) {
  const std::uint32_t frames = transfer_frames(payload_bytes);
  const std::uint32_t last = frames == 1u ? payload_bytes + 1u : payload_bytes + 2u - 7u * (frames - 1u) + 1u;
  return (frames - 1u) * worst_frame_bits(true, 8) + worst_frame_bits(true, last);
}

// Sorts frames as arbitration does: the smaller key wins. A standard frame beats an extended one with the same 11 leading bits.
constexpr std::uint32_t arbitration_key(const CanFrame& frame) {
  if (!frame.extended) return frame.id << 19;
  return (frame.id >> 18) << 19 | 1u << 18 | (frame.id & 0x3FFFFu);
}

}  // namespace rotorloop::protocols
