// Eight-byte frames of the 11-bit channels as one little-endian 64-bit word: bit i of a field table is bit i of the word.
#pragma once
#include <cstddef>
#include <cstdint>

#include "protocols/can_frame.hpp"

namespace rotorloop::protocols::detail {

constexpr CanFrame word_frame(std::uint32_t id, std::uint8_t length, std::uint64_t word) {
  CanFrame f{.id = id, .extended = false, .length = length, .data = {}};
  for (std::size_t i = 0; i < length; ++i) f.data[i] = static_cast<std::uint8_t>(word >> (8u * i) & 0xFFu);
  return f;
}

constexpr std::uint64_t frame_word(const CanFrame& f) {
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < f.length && i < 8; ++i) word |= static_cast<std::uint64_t>(f.data[i]) << (8u * i);
  return word;
}

constexpr std::uint64_t field(std::uint64_t value, unsigned bits, unsigned at) { return (value & ((std::uint64_t{1} << bits) - 1u)) << at; }
constexpr std::uint64_t field(std::int32_t value, unsigned bits, unsigned at) { return field(static_cast<std::uint64_t>(value), bits, at); }

constexpr std::uint32_t unsigned_field(std::uint64_t word, unsigned bits, unsigned at) {
  return static_cast<std::uint32_t>(word >> at & ((std::uint64_t{1} << bits) - 1u));
}
constexpr std::int32_t signed_field(std::uint64_t word, unsigned bits, unsigned at) {
  const std::uint32_t sign = 1u << (bits - 1u);
  return static_cast<std::int32_t>((unsigned_field(word, bits, at) ^ sign) - sign);
}

}  // namespace rotorloop::protocols::detail
