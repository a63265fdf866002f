// Absolute deadlines in virtual time: what is late, what is caught up, what ends a run.
#include "host/base/deadlines.hpp"

#include <gtest/gtest.h>

namespace rotorloop {
namespace {

constexpr std::int64_t kMs = 1'000'000, kUs = 1'000;

TEST(Deadlines, AreAbsolute_OneLateStepOf3MsDoesNotMoveTheOnesAfterIt) {
  Deadlines deadlines(0, kMs);
  EXPECT_TRUE(deadlines.begin_step(0));
  EXPECT_TRUE(deadlines.begin_step(4 * kMs));  // due at 1 ms
  EXPECT_TRUE(deadlines.begin_step(4 * kMs));  // the steps of 2, 3 and 4 ms follow at once
  EXPECT_TRUE(deadlines.begin_step(4 * kMs));
  EXPECT_TRUE(deadlines.begin_step(4 * kMs));
  EXPECT_EQ(deadlines.next_ns(), 5 * kMs);
  EXPECT_EQ(deadlines.lateness().steps, 5u);
  EXPECT_EQ(deadlines.lateness().missed, 2u) << "3 and 2 ms late: the next one was due already";
  EXPECT_EQ(deadlines.lateness().worst_ns, 3 * kMs);
}

TEST(Deadlines, StepsUpTo20MsBehindAreCaughtUp_OneFurtherBehindEndsTheRun) {
  Deadlines deadlines(0, kMs);
  EXPECT_TRUE(deadlines.begin_step(20 * kMs));
  EXPECT_FALSE(deadlines.begin_step(21 * kMs + 1));
}

TEST(Deadlines, ABeginningBeforeTheDeadlineIsNotLate) {
  Deadlines deadlines(10 * kMs, kMs);
  EXPECT_TRUE(deadlines.begin_step(9 * kMs));
  EXPECT_EQ(deadlines.lateness().worst_ns, 0);
  EXPECT_EQ(deadlines.lateness().counts[0], 1u);
}

TEST(Deadlines, TheHistogramHoldsEveryStepAndItsQuantilesAreUpperEndsOfClasses) {
  Deadlines deadlines(0, kMs);
  for (int n = 0; n < 998; ++n) deadlines.begin_step(n * kMs + 7 * kUs);
  deadlines.begin_step(998 * kMs + 45 * kUs);
  deadlines.begin_step(999 * kMs + 60 * kMs);  // beyond the last class of 50 ms
  const Lateness& l = deadlines.lateness();
  EXPECT_EQ(l.counts[0], 998u);  // up to 10 us
  EXPECT_EQ(l.counts[2], 1u);    // up to 50 us
  EXPECT_EQ(l.counts[l.counts.size() - 1], 1u);
  EXPECT_EQ(l.quantile_us(0.5), 10.0);
  EXPECT_EQ(l.quantile_us(0.999), 50.0);
  EXPECT_EQ(l.quantile_us(1.0), 60'000.0);
}

TEST(Deadlines, AQuantileIsNeverAboveTheWorst) {
  Deadlines deadlines(0, kMs);
  deadlines.begin_step(3 * kUs);
  EXPECT_EQ(deadlines.lateness().quantile_us(0.999), 3.0);
}

}  // namespace
}  // namespace rotorloop
