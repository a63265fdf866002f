#include "host/bus/live/multicast_packet.hpp"

#include "protocols/crc.hpp"

namespace rotorloop {
namespace {

constexpr std::uint32_t kExtendedBit = 1u << 31, kRemoteBit = 1u << 30, kErrorBit = 1u << 29;
constexpr std::size_t kCrcEnd = 4;  // magic and CRC: the CRC covers what follows

std::uint32_t little_endian(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = bytes.size(); i > 0; --i) value = value << 8 | bytes[i - 1];
  return value;
}

void put_little_endian(std::span<std::uint8_t> out, std::uint32_t value) {
  for (std::uint8_t& byte : out) {
    byte = static_cast<std::uint8_t>(value & 0xFFu);
    value >>= 8;
  }
}

}  // namespace

std::size_t encode_multicast(const BusFrame& frame, std::array<std::uint8_t, kMulticastPacket>& out) {
  const std::size_t size = kMulticastHeader + frame.length;
  const std::span<std::uint8_t> bytes(out);
  put_little_endian(bytes.subspan(0, 2), kMulticastMagic);
  put_little_endian(bytes.subspan(4, 2), frame.fd ? kMulticastFd : 0);
  put_little_endian(bytes.subspan(6, 4), frame.id | (frame.extended ? kExtendedBit : 0));
  std::copy_n(frame.data.begin(), frame.length, bytes.begin() + kMulticastHeader);
  put_little_endian(bytes.subspan(2, 2), protocols::crc16(protocols::kCrc16Start, bytes.subspan(kCrcEnd, size - kCrcEnd)));
  return size;
}

MulticastContent decode_multicast(std::span<const std::uint8_t> packet, BusFrame& frame) {
  if (packet.size() < kMulticastHeader || packet.size() > kMulticastPacket || little_endian(packet.subspan(0, 2)) != kMulticastMagic ||
      little_endian(packet.subspan(2, 2)) != protocols::crc16(protocols::kCrc16Start, packet.subspan(kCrcEnd)))
    return MulticastContent::malformed;
  const std::uint32_t id = little_endian(packet.subspan(6, 4));
  if ((id & kErrorBit) != 0) return MulticastContent::error_report;
  if ((id & kRemoteBit) != 0) return MulticastContent::remote;
  const std::span<const std::uint8_t> data = packet.subspan(kMulticastHeader);
  frame = {};
  frame.extended = (id & kExtendedBit) != 0;
  frame.id = id & ~kExtendedBit;
  frame.fd = (little_endian(packet.subspan(4, 2)) & kMulticastFd) != 0;
  frame.length = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), frame.data.begin());
  return possible(frame) ? MulticastContent::frame : MulticastContent::malformed;
}

}  // namespace rotorloop
