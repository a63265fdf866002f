// Frames waiting for the bus, handed out as arbitration would: the smallest identifier first, equal identifiers in the order
// they came (a multi-frame transfer must not be shuffled). Fixed size; a full queue refuses, it never overwrites.
#pragma once
#include <array>
#include <cstddef>
#include <optional>

#include "protocols/bus_load.hpp"
#include "protocols/can_frame.hpp"

namespace rotorloop::firmware {

template <std::size_t Capacity>
class FrameQueue {
 public:
  constexpr bool push(const CanFrame& frame) {
    if (size_ == Capacity) return false;
    frames_[size_++] = frame;
    return true;
  }
  // A waiting frame of the same identifier is old news: takes its place. True when there was one.
  constexpr bool replace(const CanFrame& frame) {
    for (std::size_t i = 0; i < size_; ++i) {
      if (frames_[i].id == frame.id && frames_[i].extended == frame.extended) {
        frames_[i] = frame;
        return true;
      }
    }
    return false;
  }
  constexpr std::optional<CanFrame> pop() {
    if (size_ == 0) return std::nullopt;
    std::size_t first = 0;
    for (std::size_t i = 1; i < size_; ++i) {
      if (protocols::arbitration_key(frames_[i]) < protocols::arbitration_key(frames_[first])) first = i;
    }
    const CanFrame frame = frames_[first];
    --size_;
    for (std::size_t i = first; i < size_; ++i) frames_[i] = frames_[i + 1];  // keeps the age order
    return frame;
  }
  constexpr std::size_t size() const { return size_; }
  constexpr std::size_t room() const { return Capacity - size_; }

 private:
  std::array<CanFrame, Capacity> frames_{};
  std::size_t size_ = 0;
};

}  // namespace rotorloop::firmware
