// The one clock of a lockstep run: integer nanoseconds since the start of the run. Nothing in sim/ reads another clock.
// The PWM grid is 48 kHz, 20 833.3 ns: tick n stands at floor(n * 62500 / 3) ns, so that 48 ticks are exactly 1 ms, the grid
// never drifts against the 1 kHz loops, and no tick depends on how many were taken before it.
#pragma once
#include <cstdint>
#include <limits>

namespace rotorloop::sim {

inline constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();
inline constexpr std::int64_t kNs_per_ms = 1'000'000;
inline constexpr std::int64_t kNs_per_s = 1'000'000'000;
inline constexpr std::int64_t kPwm_Hz = 48'000;

// Start of PWM period n >= 0, in ns. Valid up to n = 1.4e14 (90 years).
constexpr std::int64_t pwm_tick_ns(std::int64_t n) { return n * 62'500 / 3; }

// The first PWM tick that is not before time_ns >= 0.
constexpr std::int64_t first_pwm_tick_at_or_after(std::int64_t time_ns) {
  const std::int64_t n = time_ns * 3 / 62'500;
  return pwm_tick_ns(n) >= time_ns ? n : n + 1;
}

// A clock that only moves forward. advance_to() an earlier time changes nothing and says so.
class VirtualTime {
 public:
  constexpr std::int64_t now_ns() const { return now_ns_; }
  [[nodiscard]] constexpr bool advance_to(std::int64_t time_ns) {
    if (time_ns < now_ns_) return false;
    now_ns_ = time_ns;
    return true;
  }

 private:
  std::int64_t now_ns_ = 0;
};

}  // namespace rotorloop::sim
