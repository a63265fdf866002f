// The transfer CRC of DroneCAN: CRC-16-CCITT-FALSE (polynomial 0x1021, start 0xFFFF, no reflection, check 0x29B1), run over
// the 64-bit signature of the data type (little-endian) and then over the payload. The part over the signature is a constant
// per type and serves as the start value. Sixteen entries instead of 256: the table costs 32 bytes of flash. Below it the CRC-64
// that signatures are made of.
#pragma once
#include <array>
#include <cstdint>
#include <span>

namespace rotorloop::protocols {

namespace detail {
constexpr std::array<std::uint16_t, 16> make_crc16_table() {
  std::array<std::uint16_t, 16> table{};
  for (std::uint32_t i = 0; i < 16; ++i) {
    std::uint32_t crc = i << 12;
    for (int k = 0; k < 4; ++k) crc = (crc & 0x8000u) != 0 ? (crc << 1) ^ 0x1021u : crc << 1;
    table[i] = static_cast<std::uint16_t>(crc & 0xFFFFu);
  }
  return table;
}
inline constexpr std::array<std::uint16_t, 16> kCrc16Table = make_crc16_table();
}  // namespace detail

inline constexpr std::uint16_t kCrc16Start = 0xFFFF;

constexpr std::uint16_t crc16(std::uint16_t crc, std::uint8_t byte) {
  std::uint32_t c = crc;
  c = (c << 4 ^ detail::kCrc16Table[(c >> 12 ^ byte >> 4) & 0xFu]) & 0xFFFFu;
  c = (c << 4 ^ detail::kCrc16Table[(c >> 12 ^ byte) & 0xFu]) & 0xFFFFu;
  return static_cast<std::uint16_t>(c);
}

constexpr std::uint16_t crc16(std::uint16_t crc, std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t b : bytes) crc = crc16(crc, b);
  return crc;
}

constexpr std::uint16_t crc16_of_signature(std::uint64_t signature) {
  std::uint16_t crc = kCrc16Start;
  for (int i = 0; i < 8; ++i) crc = crc16(crc, static_cast<std::uint8_t>(signature >> (8 * i) & 0xFFu));
  return crc;
}

// CRC-64-WE (polynomial 0x42F0E1EBA9EA3693, start and final xor all ones, check 0x62EC59E3F1A4F00A): signatures of data types
// and the CRC of a firmware image. Byte by byte without a table: it runs at compile time, or once per image.
class Crc64 {
 public:
  constexpr Crc64() = default;
  // Goes on from a value that another Crc64 returned.
  explicit constexpr Crc64(std::uint64_t from) : crc_(~from) {}
  constexpr void add(std::uint8_t byte) {
    crc_ ^= static_cast<std::uint64_t>(byte) << 56;
    for (int i = 0; i < 8; ++i) crc_ = (crc_ >> 63) != 0 ? crc_ << 1 ^ 0x42F0E1EBA9EA3693u : crc_ << 1;
  }
  constexpr void add(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t b : bytes) add(b);
  }
  constexpr void add_text(const char* text) {
    for (; *text != '\0'; ++text) add(static_cast<std::uint8_t>(*text));
  }
  constexpr void add_little_endian(std::uint64_t value) {
    for (unsigned i = 0; i < 8; ++i) add(static_cast<std::uint8_t>(value >> (8u * i) & 0xFFu));
  }
  constexpr std::uint64_t value() const { return ~crc_; }

 private:
  std::uint64_t crc_ = ~std::uint64_t{0};
};

}  // namespace rotorloop::protocols
