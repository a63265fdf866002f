// Bytes as text, for tests that compare with documented examples.
#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "protocols/can_frame.hpp"

namespace rotorloop {

inline std::string hex(std::span<const std::uint8_t> bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t b : bytes) {
    text += kDigits[b >> 4];
    text += kDigits[b & 15];
  }
  return text;
}

// As in a candump line: `1E040601#0003FDF0080010C0` in lower case.
inline std::string candump(const CanFrame& f) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (int digit = f.extended ? 7 : 2; digit >= 0; --digit) text += kDigits[f.id >> (4 * digit) & 15u];
  return text + "#" + hex(std::span<const std::uint8_t>(f.data.data(), f.length));
}

}  // namespace rotorloop
