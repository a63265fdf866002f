// The CAN frames of the house: data frames only (no remote frames: neither DroneCAN nor the 11-bit channels use them).
// CanFrame is the classic frame that everything real-time uses; CanFdFrame carries up to 64 bytes and is a type of its own, so that
// the queues and rings of an ESC do not pay 64 bytes for each of their frames.
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

// A CAN FD frame. Its length is one that the data length code can say: 0..8, 12, 16, 20, 24, 32, 48 or 64.
struct CanFdFrame {
  std::uint32_t id = 0;
  bool extended = false;
  bool bit_rate_switch = true;
  std::uint8_t length = 0;
  std::array<std::uint8_t, 64> data{};

  friend bool operator==(const CanFdFrame&, const CanFdFrame&) = default;
};

// The shortest length of a CAN FD frame that holds `bytes` (0..64) bytes.
constexpr std::uint8_t fd_length(std::uint32_t bytes) {
  constexpr std::array<std::uint8_t, 7> kSteps{12, 16, 20, 24, 32, 48, 64};
  if (bytes <= 8) return static_cast<std::uint8_t>(bytes);
  for (const std::uint8_t step : kSteps) {
    if (bytes <= step) return step;
  }
  return 64;
}

}  // namespace rotorloop
