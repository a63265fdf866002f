// A frame as a live bus carries it: classic CAN or CAN FD. What the toolkit's own nodes speak is classic (protocols/can_frame.hpp);
// recorders, bridges and adapters have to carry both.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocols/can_frame.hpp"

namespace rotorloop {

struct BusFrame {
  std::uint32_t id = 0;  // 11 bits, or 29 when extended
  bool extended = false;
  bool fd = false;
  bool bit_rate_switch = false;  // FD: data at the higher rate
  std::uint8_t length = 0;       // bytes: 0..8; FD also 12, 16, 20, 24, 32, 48, 64
  std::array<std::uint8_t, 64> data{};

  BusFrame() = default;
  explicit BusFrame(const CanFrame& f) : id(f.id), extended(f.extended), length(f.length) {
    std::copy_n(f.data.begin(), f.length, data.begin());
  }
  // None for an FD frame.
  std::optional<CanFrame> classic() const {
    if (fd) return std::nullopt;
    CanFrame f{.id = id, .extended = extended, .length = length, .data = {}};
    std::copy_n(data.begin(), std::min<std::size_t>(length, 8), f.data.begin());
    return f;
  }
  friend bool operator==(const BusFrame&, const BusFrame&) = default;
};

// The data lengths beyond 8 that an FD frame can have, by length code 9..15 (ISO 11898-1:2015, table 5).
inline constexpr std::array<std::uint8_t, 7> kFdLengths{12, 16, 20, 24, 32, 48, 64};

constexpr bool possible_length(bool fd, std::size_t length) {
  return length <= 8 || (fd && std::find(kFdLengths.begin(), kFdLengths.end(), length) != kFdLengths.end());
}
inline bool possible(const BusFrame& f) { return f.id < (f.extended ? 1u << 29 : 1u << 11) && possible_length(f.fd, f.length); }

struct StampedBusFrame {
  BusFrame frame;
  std::int64_t time_ns = 0;  // as StampedFrame::time_ns
};

}  // namespace rotorloop
