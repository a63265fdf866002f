// Frames that wait for the next poll, in the order in which they came. Fixed size; a full one refuses, it never overwrites.
#pragma once
#include <array>
#include <cstddef>
#include <optional>

#include "protocols/can_frame.hpp"

namespace rotorloop::firmware {

template <std::size_t Capacity>
class FrameBuffer {
 public:
  constexpr bool push(const CanFrame& frame) {
    if (size_ == Capacity) return false;
    frames_[(first_ + size_++) % Capacity] = frame;
    return true;
  }
  constexpr std::optional<CanFrame> pop() {
    if (size_ == 0) return std::nullopt;
    const CanFrame frame = frames_[first_];
    first_ = (first_ + 1) % Capacity;
    --size_;
    return frame;
  }

 private:
  std::array<CanFrame, Capacity> frames_{};
  std::size_t first_ = 0, size_ = 0;
};

}  // namespace rotorloop::firmware
