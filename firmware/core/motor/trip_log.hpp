// The last trips as they happened. Written by the interrupt, read by the main loop: a record that was overwritten while it was read
// is not returned.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "firmware/core/interface.hpp"

namespace rotorloop::firmware {

class TripLog {
 public:
  static constexpr std::uint32_t kKept = 8;

  void add(TripRecord r) {
    r.number = count_ + 1u;
    records_[count_ % kKept] = r;
    __atomic_store_n(&count_, r.number, __ATOMIC_RELEASE);
  }
  // Since power-up.
  std::uint32_t count() const { return __atomic_load_n(&count_, __ATOMIC_ACQUIRE); }
  // ago 0: the last one.
  std::optional<TripRecord> get(std::uint32_t ago) const {
    const std::uint32_t now = count();
    if (ago >= kKept || ago >= now) return std::nullopt;
    const TripRecord r = records_[(now - 1u - ago) % kKept];
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (count() - now > kKept - 1u - ago) return std::nullopt;
    return r;
  }

 private:
  std::array<TripRecord, kKept> records_{};
  std::uint32_t count_ = 0;
};

}  // namespace rotorloop::firmware
