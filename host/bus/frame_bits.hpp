// How long a classic CAN frame occupies the wire, counted on the real bit sequence (header, data, CRC-15, stuff bits) and not
// estimated: a bus load that is measured with these numbers is exact. Sources: ISO 11898-1:2015 §10.4 (frame), §10.5 (stuffing),
// CRC polynomial x^15+x^14+x^10+x^8+x^7+x^4+x^3+1 (0x4599).
#pragma once
#include <cstdint>

#include "protocols/can_frame.hpp"

namespace rotorloop {

inline constexpr int kIntermissionBits = 3;  // recessive bits that separate two frames
inline constexpr int kFrameTailBits = 10;    // CRC delimiter, ACK slot, ACK delimiter, 7 bits end of frame: never stuffed
// From the start of a frame to its ACK slot there are frame_bits() - kAfterAckBits bits.
inline constexpr int kAfterAckBits = 8;

// CRC-15 of the frame: over start of frame, header and data, without stuff bits.
std::uint16_t frame_crc15(const CanFrame& frame);

// Stuff bits that the transmitter inserts between start of frame and the end of the CRC (one may follow the last CRC bit).
int stuff_bits(const CanFrame& frame);

// Bits from the start of frame to the last bit of the end of frame, stuff bits included, intermission not.
int frame_bits(const CanFrame& frame);

// Bits without any stuffing, start to end of frame: 44 + 8 per byte, or 64 + 8 per byte with an extended identifier.
constexpr int unstuffed_frame_bits(bool extended, int length) { return (extended ? 54 : 34) + 8 * length + kFrameTailBits; }

// What a schedulability calculation has to assume for one frame, intermission included: every stuffable bit in the worst
// pattern, floor((n - 1) / 4) stuff bits. 55 + 10 per byte, 80 + 10 per byte when extended.
constexpr int worst_case_bus_bits(bool extended, int length) {
  const int stuffable = unstuffed_frame_bits(extended, length) - kFrameTailBits;
  return stuffable + (stuffable - 1) / 4 + kFrameTailBits + kIntermissionBits;
}

// The arbitration field as a number: the lower one wins the bus. Identifier bits first; a standard frame then wins against
// an extended one with the same leading 11 bits (its RTR bit is dominant where the other sends the recessive SRR).
constexpr std::uint32_t arbitration_key(const CanFrame& frame) {
  constexpr std::uint32_t kSrrAndIde = 3u << 18;
  return frame.extended ? ((frame.id >> 18) << 20) | kSrrAndIde | (frame.id & 0x3FFFFu) : frame.id << 20;
}

}  // namespace rotorloop
