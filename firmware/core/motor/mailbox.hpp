// From the main loop to the interrupt, or back, without a lock: the single writer fills the slot that nobody reads, then turns to
// it. For one core on which an interrupt runs to its end before what it interrupted goes on:
//  - the interrupt reads whole values: the main loop writes only the slot that is not the published one;
//  - the main loop reads whole values: it reads again when the interrupt has written twice meanwhile, and so into its slot.
// test/unit/firmware/motor/mailbox_test.cpp runs the interrupt between any two instructions of the main loop.
#pragma once
#include <array>
#include <cstdint>

namespace rotorloop::firmware {

template <class T>
class Mailbox {
 public:
  void write(const T& value) {
    const std::uint32_t next = sequence_ + 1u;
    slots_[next & 1u] = value;
    __atomic_store_n(&sequence_, next, __ATOMIC_RELEASE);
  }

  // Values written so far; tells a reader whether there is a new one.
  std::uint32_t sequence() const { return __atomic_load_n(&sequence_, __ATOMIC_ACQUIRE); }

  T read() const {
    for (;;) {
      const std::uint32_t before = sequence();
      const T value = slots_[before & 1u];
      __atomic_thread_fence(__ATOMIC_ACQUIRE);
      if (sequence() - before < 2u) return value;
    }
  }

 private:
  std::array<T, 2> slots_{};
  std::uint32_t sequence_ = 0;
};

}  // namespace rotorloop::firmware
