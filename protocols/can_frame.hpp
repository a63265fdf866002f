// The one CAN frame type of the house: classic CAN, data frames only (no remote frames: neither DroneCAN nor the
// 11-bit channels use them). Protocols fill it, buses carry it.
#pragma once
#include <array>
#include <cstdint>

namespace rotorloop {

struct CanFrame {
  std::uint32_t id = 0;  // 11 bits, or 29 when extended
  bool extended = false;
  std::uint8_t length = 0;  // 0..8 bytes
  std::array<std::uint8_t, 8> data{};

  friend bool operator==(const CanFrame&, const CanFrame&) = default;
};

}  // namespace rotorloop
