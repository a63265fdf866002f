// Time stamps of an adapter's own clock on the program's clock. The system's stamp comes late by what the USB line and the scheduler take,
// never early, so the least distance seen is the nearest to the truth; it may grow by what two crystals differ at most. Pure.
#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>

namespace rotorloop {

class StampClock {
 public:
  static constexpr std::int64_t kLargestDrift_ppm = 200;  // two crystals of 100 ppm each
  static constexpr std::int64_t kJump_ns = 500'000'000;   // beyond: the adapter's clock wrapped, or it was replugged

  // `system_ns`: when the system saw the frame, on the program's clock. Returns when it was on the bus, never after that.
  std::int64_t on_the_bus_ns(std::int64_t adapter_ns, std::int64_t system_ns) {
    const std::int64_t distance_ns = system_ns - adapter_ns;
    if (!least_ns_ || distance_ns - *least_ns_ > kJump_ns || *least_ns_ - distance_ns > kJump_ns) {
      least_ns_ = distance_ns;
    } else {
      const std::int64_t grown_ns = std::max<std::int64_t>(system_ns - newest_ns_, 0) * kLargestDrift_ppm / 1'000'000;
      least_ns_ = std::min(*least_ns_ + grown_ns, distance_ns);
    }
    newest_ns_ = system_ns;
    return adapter_ns + *least_ns_;
  }

 private:
  std::optional<std::int64_t> least_ns_;
  std::int64_t newest_ns_ = 0;
};

}  // namespace rotorloop
