// How long a classic CAN frame occupies the wire, counted on the real bit sequence (header, data, CRC-15, stuff bits) and not
// estimated: a bus load that is measured with these numbers is exact. Sources: ISO 11898-1:2015 §10.4 (frame), §10.5 (stuffing),
// CRC polynomial x^15+x^14+x^10+x^8+x^7+x^4+x^3+1 (0x4599).
#pragma once
#include <cstdint>

#include "protocols/bus_load.hpp"
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

// What a schedulability calculation assumes for a frame, and who wins the bus: protocols/bus_load.hpp.
using protocols::arbitration_key;
using protocols::worst_frame_bits;

}  // namespace rotorloop
