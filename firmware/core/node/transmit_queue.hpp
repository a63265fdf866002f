// Frames waiting for the bus, handed out as arbitration would: the smallest identifier first, equal identifiers in the order
// they came (a multi-frame transfer must not be shuffled). Fixed size; a full queue refuses, it never overwrites. What has waited
// for a second is old news and leaves with its whole transfer, so that an outage of the bus ends with fresh frames.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/core/node/division.hpp"
#include "protocols/bus_load.hpp"
#include "protocols/can_frame.hpp"

namespace rotorloop::firmware {

template <std::size_t Capacity>
class TransmitQueue {
 public:
  // DroneCAN: a transmission is abandoned after a second.
  static constexpr std::uint64_t kLife_us = 1'000'000;

  // All frames of a transfer are pushed with one `now_us`: they expire together.
  constexpr bool push(const CanFrame& frame, std::uint64_t now_us) {
    if (size_ == Capacity) return false;
    entries_[size_++] = {frame, ms(now_us)};
    return true;
  }
  // A waiting frame of the same identifier is old news: the new one takes its place. True when there was one. Single-frame data only.
  constexpr bool replace(const CanFrame& frame, std::uint64_t now_us) {
    for (std::size_t i = 0; i < size_; ++i) {
      if (entries_[i].frame.id == frame.id && entries_[i].frame.extended == frame.extended) {
        entries_[i] = {frame, ms(now_us)};
        return true;
      }
    }
    return false;
  }
  constexpr std::optional<CanFrame> pop() {
    if (size_ == 0) return std::nullopt;
    std::size_t first = 0;
    std::uint32_t least = protocols::arbitration_key(entries_[0].frame);
    for (std::size_t i = 1; i < size_; ++i) {
      const std::uint32_t key = protocols::arbitration_key(entries_[i].frame);
      if (key < least) {
        first = i;
        least = key;
      }
    }
    const CanFrame frame = entries_[first].frame;
    --size_;
    for (std::size_t i = first; i < size_; ++i) entries_[i] = entries_[i + 1];  // keeps the age order
    return frame;
  }
  // Drops what is older than kLife_us; the number of frames dropped.
  constexpr std::size_t expire(std::uint64_t now_us) {
    const std::uint32_t now_ms = ms(now_us);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      if (now_ms - entries_[i].queued_ms > kLife_us / 1000) continue;
      if (kept != i) entries_[kept] = entries_[i];  // at most polls nothing has expired
      ++kept;
    }
    const std::size_t dropped = size_ - kept;
    size_ = kept;
    return dropped;
  }
  constexpr void clear() { size_ = 0; }
  constexpr std::size_t size() const { return size_; }
  constexpr std::size_t room() const { return Capacity - size_; }

 private:
  struct Entry {
    CanFrame frame{};
    std::uint32_t queued_ms = 0;  // wraps after 49 days; only differences count
  };
  static constexpr std::uint32_t ms(std::uint64_t now_us) { return divide(now_us, 1000).quotient; }
  std::array<Entry, Capacity> entries_{};
  std::size_t size_ = 0;
};

}  // namespace rotorloop::firmware
