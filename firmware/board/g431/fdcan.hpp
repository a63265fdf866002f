// FDCAN1 as the CAN port of an ESC (firmware/board/application_board.hpp). The controller keeps three received frames, which a full bus
// fills in 141 us: an interrupt moves them into a ring, with the time. Classic frames: the board's transceiver is not made for the fast
// phase.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/board/application_board.hpp"
#include "firmware/board/g431/fdcan_registers.hpp"
#include "firmware/board/g431/rcc.hpp"

namespace rotorloop::g431 {

// A bit of 17 time quanta: 1 to synchronise, 14 before the sample point, 2 behind it: 88.2 %, as CiA recommends 87.5.
struct CanBitTiming {
  std::uint32_t divider = 0, before = 14, after = 2, jump = 2;
  constexpr std::uint32_t quanta() const { return 1 + before + after; }
  constexpr std::uint32_t nbtp() const { return field(jump - 1, 25) | field(divider - 1, 16) | field(before - 1, 8) | (after - 1); }
};
// Empty when the clock does not divide into this rate exactly.
constexpr std::optional<CanBitTiming> can_bit_timing(std::uint32_t clock_Hz, std::uint32_t bit_rate) {
  CanBitTiming t;
  if (bit_rate == 0 || clock_Hz % (bit_rate * t.quanta()) != 0) return std::nullopt;
  t.divider = clock_Hz / (bit_rate * t.quanta());
  return t.divider >= 1 && t.divider <= 512 ? std::optional(t) : std::nullopt;
}

// One writer, the interrupt; one reader, the main loop. A full ring drops the newest and counts it.
template <std::size_t kSize>
class ReceiveRing {
 public:
  static_assert(kSize >= 16 && (kSize & (kSize - 1)) == 0);
  void push(const firmware::Received<CanFrame>& frame) {
    const std::uint32_t written = __atomic_load_n(&written_, __ATOMIC_RELAXED);
    if (written - __atomic_load_n(&read_, __ATOMIC_ACQUIRE) == kSize) {
      ++dropped_;
      return;
    }
    frames_[written % kSize] = frame;
    __atomic_store_n(&written_, written + 1, __ATOMIC_RELEASE);
  }
  std::optional<firmware::Received<CanFrame>> pop() {
    const std::uint32_t read = __atomic_load_n(&read_, __ATOMIC_RELAXED);
    if (read == __atomic_load_n(&written_, __ATOMIC_ACQUIRE)) return std::nullopt;
    const auto frame = frames_[read % kSize];
    __atomic_store_n(&read_, read + 1, __ATOMIC_RELEASE);
    return frame;
  }
  std::uint32_t dropped() const { return dropped_; }

 private:
  std::array<firmware::Received<CanFrame>, kSize> frames_{};
  std::uint32_t written_ = 0, read_ = 0, dropped_ = 0;
};

class Fdcan {
 public:
  static constexpr bool kFd = false;
  static constexpr std::size_t kStandardFilters = 28, kExtendedFilters = 8;

  // Pins and transceiver are the board's. False: a bit rate that the clock does not make, or a controller that does not answer.
  bool start(std::uint32_t bit_rate);
  // Interrupt line 0. `now_us`: at its begin.
  void on_interrupt(std::uint64_t now_us);

  // The controller takes equal identifiers by the number of the buffer, and gives out the lowest free one: after a gap a later frame would
  // overtake an earlier one of its transfer. So a buffer below one that waits is not used before all have left.
  bool ready() const;
  bool send(const CanFrame& frame);
  bool all_sent() const { return (fdcan().txbrp.read() & 7u) == 0; }
  std::optional<firmware::Received<CanFrame>> receive() { return ring_.pop(); }
  bool set_filters(std::span<const CanFilter> filters);
  BusState state() const;
  void recover();

  std::uint32_t dropped() const { return ring_.dropped(); }
  std::uint32_t lost() const { return lost_; }  // times that the controller's FIFO was full

 private:
  bool enter_configuration();
  ReceiveRing<32> ring_;
  std::uint32_t lost_ = 0;
};
static_assert(firmware::CanPort<Fdcan>);

}  // namespace rotorloop::g431
