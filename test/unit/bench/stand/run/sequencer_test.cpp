// What comes next in a run, by times and speeds alone: no bus, no motor.
#include "bench/stand/run/sequencer.hpp"

#include <gtest/gtest.h>

namespace rotorloop {
namespace {

using stand_run::Motion;
using stand_run::Phase;
using stand_run::Segment;
using stand_run::Sequencer;

constexpr std::int64_t kMs = 1'000'000;

Segment hold(double omega_rad_s) { return {.motion = Motion::hold, .omega_rad_s = omega_rad_s, .duration_s = 1.0, .measured = true}; }

// Turns of 1 ms from 0 on.
struct Turns {
  stand_run::Plan plan;
  Sequencer s;
  std::int64_t now_ms = 0;
  explicit Turns(std::vector<Segment> segments, stand_run::SequencerOptions o = {}) : plan{{"test"}, std::move(segments), {}}, s(plan, o) {
    s.begin(0);
  }
  void until(std::int64_t end_ms, bool rests = true) {
    for (; now_ms < end_ms; ++now_ms) s.advance((now_ms + 1) * kMs, rests);
  }
};

TEST(StandSequencer, AStartTo500RadPerSIsSlewedAt2000AndAStepOfLessThanAQuarterIsNot) {
  Turns t({hold(500.0), hold(550.0)});
  t.until(100);
  EXPECT_NEAR(t.s.set_point_rad_s(), 200.0, 1e-6);
  t.until(1701);  // 0.7 s to settle, 1 s that counts
  EXPECT_EQ(t.s.segment_index(), 1u);
  t.until(1702);
  EXPECT_EQ(t.s.set_point_rad_s(), 550.0);
}

TEST(StandSequencer, AHoldCountsWhenItRestsAfter700msAndAsUnsettledAfter5sMore) {
  Turns rests({hold(500.0)}), never({hold(500.0)});
  rests.until(690);
  EXPECT_FALSE(rests.s.measuring());
  rests.until(710);
  EXPECT_TRUE(rests.s.measuring());
  EXPECT_EQ(rests.s.step(), 0);
  EXPECT_TRUE(rests.s.settled());
  never.until(5690, false);
  EXPECT_FALSE(never.s.measuring());
  never.until(5710, false);
  EXPECT_TRUE(never.s.measuring());
  EXPECT_FALSE(never.s.settled());
}

TEST(StandSequencer, StepsThatCountAreNumberedInTheirOrderAndOthersAreNone) {
  Segment idle = hold(300.0);
  idle.measured = false;
  Turns t({hold(500.0), idle, hold(600.0)});
  std::vector<int> seen;
  while (t.s.turning()) {
    t.until(t.now_ms + 1);
    if (t.s.measuring() && (seen.empty() || seen.back() != t.s.step())) seen.push_back(t.s.step());
  }
  EXPECT_EQ(seen, (std::vector<int>{0, -1, 1}));
}

TEST(StandSequencer, ALimitThatHoldsKeepsLaterSegmentsAtThePresentSpeedAndMarksThem) {
  Turns t({hold(500.0), hold(900.0)});
  t.until(1000);
  t.s.hold_speed();
  t.until(3000);
  EXPECT_EQ(t.s.segment_index(), 1u);
  EXPECT_EQ(t.s.set_point_rad_s(), 500.0);
  EXPECT_TRUE(t.s.limited());
}

TEST(StandSequencer, RampingDownFrom500RadPerSTakesAQuarterOfASecondThen300msOfZeros) {
  Turns t({hold(500.0)});
  t.until(1000);
  t.s.ramp_down();
  t.until(1240);
  EXPECT_GT(t.s.set_point_rad_s(), 0.0);
  t.until(1260);
  EXPECT_EQ(t.s.phase(), Phase::stopping);
  t.until(1540);
  EXPECT_EQ(t.s.phase(), Phase::stopping);
  t.until(1560);
  EXPECT_EQ(t.s.phase(), Phase::done);
}

TEST(StandSequencer, StoppingIsZeroInTheSameTurn) {
  Turns t({hold(500.0)});
  t.until(1000);
  t.s.stop(t.now_ms * kMs);
  t.until(1001);
  EXPECT_EQ(t.s.set_point_rad_s(), 0.0);
}

TEST(StandSequencer, APlanThatWaitsForItsConfigurationBeginsTheSegmentWhenItIsThere) {
  Segment zero{.motion = Motion::zero, .duration_s = 1.0, .measured = true};
  Turns t({zero, hold(500.0)});
  for (int i = 0; i < 100; ++i) {
    t.until(t.now_ms + 100);
    t.s.wait(t.now_ms * kMs);
  }
  EXPECT_EQ(t.s.segment_index(), 0u);
  t.until(t.now_ms + 3110);  // zeros settle three times as long
  EXPECT_EQ(t.s.segment_index(), 1u);
}

}  // namespace
}  // namespace rotorloop
