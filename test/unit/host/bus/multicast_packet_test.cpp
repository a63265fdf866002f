// The datagrams of the multicast bus, against packets made by an independent implementation (Python, CRC bit by bit).
#include "host/bus/live/multicast_packet.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace rotorloop {
namespace {

std::vector<std::uint8_t> bytes(const std::string& hex) {
  std::vector<std::uint8_t> out;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) out.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return out;
}

BusFrame frame(std::uint32_t id, bool extended, const std::string& hex, bool fd = false) {
  BusFrame f;
  f.id = id;
  f.extended = extended;
  f.fd = fd;
  for (const std::uint8_t b : bytes(hex)) f.data[f.length++] = b;
  return f;
}

struct Known {
  BusFrame frame;
  std::string packet;
};
const std::vector<Known> kKnown{
    {frame(0x1401552A, true, "87d6120008efbec0"), "342913fb00002a55019487d6120008efbec0"},
    {frame(0x140, false, "8813f401"), "342964220000400100008813f401"},
    {frame(0x07040678, true, "000102030405060708090a0b", true), "3429c5eb010078060487000102030405060708090a0b"}};

TEST(MulticastPacket, EqualsThatOfAnIndependentImplementationInBothDirections) {
  for (const Known& known : kKnown) {
    std::array<std::uint8_t, kMulticastPacket> packet{};
    const std::size_t size = encode_multicast(known.frame, packet);
    EXPECT_EQ(std::vector<std::uint8_t>(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(size)), bytes(known.packet));
    BusFrame back;
    ASSERT_EQ(decode_multicast(bytes(known.packet), back), MulticastContent::frame);
    EXPECT_EQ(back, known.frame);
  }
}

TEST(MulticastPacket, AnyFlippedBitIsRefused) {
  const std::vector<std::uint8_t> good = bytes(kKnown[0].packet);
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    std::vector<std::uint8_t> packet = good;
    packet[bit / 8] = static_cast<std::uint8_t>(packet[bit / 8] ^ 1u << bit % 8);
    BusFrame f;
    EXPECT_EQ(decode_multicast(packet, f), MulticastContent::malformed) << "bit " << bit;
  }
}

TEST(MulticastPacket, ShorterThanItsHeaderOrLongerThan74BytesIsRefused) {
  BusFrame f;
  for (const std::size_t size : {0u, 1u, 9u, 75u, 1500u})
    EXPECT_EQ(decode_multicast(std::vector<std::uint8_t>(size), f), MulticastContent::malformed) << size;
}

TEST(MulticastPacket, ClassicFramesOfNineBytesAndFdFramesOfALengthThatNoCodeHasAreRefused) {
  for (const auto& [length, fd] : {std::pair{9, false}, {9, true}, {13, true}, {63, true}}) {
    BusFrame f = frame(0x123, false, "", fd);
    f.length = static_cast<std::uint8_t>(length);
    std::array<std::uint8_t, kMulticastPacket> packet{};
    const std::size_t size = encode_multicast(f, packet);
    BusFrame back;
    EXPECT_EQ(decode_multicast({packet.data(), size}, back), MulticastContent::malformed) << length;
  }
}

TEST(MulticastPacket, RemoteFramesAndErrorReportsAreNamedForWhatTheyAre) {
  for (const auto& [flag, content] : {std::pair{0x40000000u, MulticastContent::remote}, {0x20000000u, MulticastContent::error_report}}) {
    BusFrame f = frame(0x123 | flag, false, "");
    std::array<std::uint8_t, kMulticastPacket> packet{};
    const std::size_t size = encode_multicast(f, packet);
    BusFrame back;
    EXPECT_EQ(decode_multicast({packet.data(), size}, back), content);
  }
}

}  // namespace
}  // namespace rotorloop
