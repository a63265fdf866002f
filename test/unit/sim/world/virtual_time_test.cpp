// The PWM grid against the millisecond grid.
#include "sim/world/virtual_time.hpp"

#include <gtest/gtest.h>

namespace rotorloop::sim {
namespace {

TEST(VirtualTime, FortyEightPwmTicksAreExactlyOneMillisecondForAnHour) {
  for (std::int64_t ms = 0; ms <= 3'600'000; ms += 997) EXPECT_EQ(pwm_tick_ns(48 * ms), ms * kNs_per_ms);
}

TEST(VirtualTime, PwmPeriodsAre20833Or20834Nanoseconds) {
  for (std::int64_t n = 0; n < 1000; ++n) {
    const std::int64_t period_ns = pwm_tick_ns(n + 1) - pwm_tick_ns(n);
    EXPECT_TRUE(period_ns == 20'833 || period_ns == 20'834) << "tick " << n;
  }
}

TEST(VirtualTime, FirstTickAtOrAfterATimeIsTheInverseOfTheGrid) {
  for (std::int64_t n = 1; n < 5000; ++n) {
    EXPECT_EQ(first_pwm_tick_at_or_after(pwm_tick_ns(n)), n);
    EXPECT_EQ(first_pwm_tick_at_or_after(pwm_tick_ns(n) + 1), n + 1);
    EXPECT_EQ(first_pwm_tick_at_or_after(pwm_tick_ns(n) - 1), n);
  }
  EXPECT_EQ(first_pwm_tick_at_or_after(0), 0);
}

TEST(VirtualTime, ClockRefusesToRunBackwards) {
  VirtualTime clock;
  EXPECT_TRUE(clock.advance_to(5));
  EXPECT_TRUE(clock.advance_to(5));
  EXPECT_FALSE(clock.advance_to(4));
  EXPECT_EQ(clock.now_ns(), 5);
}

}  // namespace
}  // namespace rotorloop::sim
