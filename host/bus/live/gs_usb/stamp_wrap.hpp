// The adapter's clock of 32 bits in microseconds, which wraps after 71.6 minutes, as one that does not. Pure.
#pragma once
#include <cstdint>
#include <optional>

namespace rotorloop::gs_usb {

class StampWrap {
 public:
  // Nanoseconds of the adapter's clock since it last was 0 before the first stamp. Stamps may come out of order by up to half a turn.
  std::int64_t unwrapped_ns(std::uint32_t stamp_us) {
    if (!newest_us_) newest_us_ = stamp_us;
    const std::int64_t ahead_us = static_cast<std::int32_t>(stamp_us - static_cast<std::uint32_t>(*newest_us_));
    const std::int64_t us = *newest_us_ + ahead_us;
    if (ahead_us > 0) newest_us_ = us;
    return us * 1000;
  }

 private:
  std::optional<std::int64_t> newest_us_;
};

}  // namespace rotorloop::gs_usb
