// CRC and stuff bits byte by byte through two tables, because the virtual bus asks for every frame that is sent. The bit
// sequence is aligned so that the data start on a byte: ahead of the start of frame stand recessive-ending filler bits, which
// cannot cause a stuff bit, and the 15 CRC bits are filled up with the inverse of the last one, which cannot either.
#include "host/bus/frame_bits.hpp"

#include <array>

namespace rotorloop {
namespace {

constexpr std::uint16_t kCrcPolynomial = 0x4599;

constexpr auto kCrcTable = [] {
  std::array<std::uint16_t, 256> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    unsigned crc = byte << 7;  // the byte meets the top 8 of 15 bits
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x4000u) != 0 ? (crc << 1) ^ kCrcPolynomial : crc << 1;
    table[byte] = static_cast<std::uint16_t>(crc & 0x7FFFu);
  }
  return table;
}();

// Run state: level of the last bit on the wire and how many equal bits stand there (1..4; a fifth inserts a stuff bit,
// which begins a new run of the other level). State = 4 * level + run - 1.
struct StuffStep {
  std::uint8_t next_state;
  std::uint8_t stuffed;
};

constexpr auto kStuffTable = [] {
  std::array<std::array<StuffStep, 256>, 8> table{};
  for (unsigned state = 0; state < 8; ++state) {
    for (unsigned byte = 0; byte < 256; ++byte) {
      unsigned level = state / 4;
      unsigned run = state % 4 + 1;
      unsigned stuffed = 0;
      for (int bit = 7; bit >= 0; --bit) {
        const unsigned b = (byte >> bit) & 1u;
        run = b == level ? run + 1 : 1;
        level = b;
        if (run == 5) {
          ++stuffed;
          level ^= 1u;
          run = 1;
        }
      }
      table[state][byte] = {static_cast<std::uint8_t>(4 * level + run - 1), static_cast<std::uint8_t>(stuffed)};
    }
  }
  return table;
}();

constexpr std::uint8_t kAfterOneRecessive = 4;  // level 1, run 1: the bus before the start of frame

// Start of frame to DLC, right-aligned: 19 bits, or 39 when extended.
constexpr std::uint64_t header(const CanFrame& f) {
  if (!f.extended) return (std::uint64_t{f.id & 0x7FFu} << 7) | f.length;  // SOF 0, id, RTR 0, IDE 0, r0 0, DLC
  const std::uint64_t base = (f.id >> 18) & 0x7FFu;
  const std::uint64_t rest = f.id & 0x3FFFFu;
  return (base << 27) | (std::uint64_t{3} << 25) | (rest << 7) | f.length;  // SOF 0, base, SRR 1, IDE 1, rest, RTR 0, r1 0, r0 0, DLC
}

constexpr std::uint16_t crc_step(std::uint16_t crc, unsigned byte) {
  return static_cast<std::uint16_t>(((crc << 8) ^ kCrcTable[((crc >> 7) ^ byte) & 0xFFu]) & 0x7FFFu);
}

}  // namespace

std::uint16_t frame_crc15(const CanFrame& f) {
  // Leading zeros leave the CRC register at zero, so the header may be taken as whole bytes.
  const std::uint64_t head = header(f);
  std::uint16_t crc = 0;
  for (int byte = f.extended ? 4 : 2; byte >= 0; --byte) crc = crc_step(crc, static_cast<unsigned>(head >> (8 * byte)) & 0xFFu);
  for (int i = 0; i < f.length; ++i) crc = crc_step(crc, f.data[static_cast<std::size_t>(i)]);
  return crc;
}

int stuff_bits(const CanFrame& f) {
  const std::uint64_t filler = f.extended ? std::uint64_t{1} << 39 : std::uint64_t{0b10101} << 19;
  const std::uint64_t head = header(f) | filler;
  const unsigned crc = frame_crc15(f);
  const unsigned end = (crc << 1) | (~crc & 1u);
  std::uint8_t state = kAfterOneRecessive;
  int count = 0;
  const auto take = [&](unsigned byte) {
    const StuffStep step = kStuffTable[state][byte & 0xFFu];
    state = step.next_state;
    count += step.stuffed;
  };
  // The first filler bit is recessive and merges with kAfterOneRecessive to a run of two at most; the start of frame ends it.
  for (int byte = f.extended ? 4 : 2; byte >= 0; --byte) take(static_cast<unsigned>(head >> (8 * byte)));
  for (int i = 0; i < f.length; ++i) take(f.data[static_cast<std::size_t>(i)]);
  take(end >> 8);
  take(end);
  return count;
}

int frame_bits(const CanFrame& f) { return unstuffed_frame_bits(f.extended, f.length) + stuff_bits(f); }

}  // namespace rotorloop
