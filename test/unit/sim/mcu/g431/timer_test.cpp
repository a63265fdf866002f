// Timers, sentence by sentence of RM0440, chapters 28 to 31. HCLK is 16 MHz (HSI) with undivided buses: one tick is one cycle.
#include "sim/mcu/g431/timer_registers.hpp"
#include "test/unit/sim/mcu/g431/bench.hpp"

namespace rotorloop::mcu::g431::testing {
namespace {

using namespace tim;
constexpr uint32_t kTim1 = 0x40012C00, kTim2 = 0x40000000, kTim3 = 0x40000400, kTim6 = 0x40001000;

// What pins do, with the cycle at which they do it.
struct Edge {
  uint64_t cycle;
  uint32_t pin;
  bool high;
};
class Scope : public Pins {
 public:
  explicit Scope(Chip& chip) : chip_(chip) { chip.pins = this; }
  void on_pin(uint32_t pin, bool driven, bool high) override { edges.push_back({chip_.now(), pin, driven && high}); }
  std::vector<Edge> of(uint32_t pin) const {
    std::vector<Edge> out;
    for (const Edge& e : edges)
      if (e.pin == pin) out.push_back(e);
    return out;
  }
  std::vector<Edge> edges;

 private:
  Chip& chip_;
};

class McuTimer : public ::testing::Test {
 protected:
  McuTimer() { b.clock_everything(); }
  void alternate(uint32_t pin, uint32_t af) {
    const uint32_t port = 0x48000000 + 0x400 * (pin / 16), n = pin % 16, afr = port + (n < 8 ? 0x20 : 0x24);
    b.write(afr, (b.read(afr) & ~(15u << 4 * (n & 7))) | af << 4 * (n & 7));
    b.write(port, (b.read(port) & ~(3u << 2 * n)) | 2u << 2 * n);
  }
  Bench b;
};

TEST_F(McuTimer, TheCounterCountsTheClockDividedByPscPlusOneAndTheUpdateFlagComesAtArrPlusOne) {
  b.write(kTim3 + PSC, 15);
  b.write(kTim3 + ARR, 999);
  b.write(kTim3 + EGR, 1);  // loads the prescaler
  b.write(kTim3 + SR, 0);
  b.write(kTim3 + CR1, CEN);
  b.run_us(999);
  EXPECT_EQ(b.read(kTim3 + SR) & UIF, 0u);
  EXPECT_NEAR(b.read(kTim3 + CNT), 999, 1);
  b.run_us(2);
  EXPECT_EQ(b.read(kTim3 + SR) & UIF, UIF);
  EXPECT_LE(b.read(kTim3 + CNT), 2u);
}

TEST_F(McuTimer, FlagsAreClearedByWritingZeroAndNotSetByWritingOne) {
  b.write(kTim3 + ARR, 99);
  b.write(kTim3 + CR1, CEN);
  b.run_cycles(500);
  const uint32_t before = b.read(kTim3 + SR);
  EXPECT_EQ(before & UIF, UIF);
  b.write(kTim3 + CR1, 0);
  b.write(kTim3 + SR, ~UIF);
  EXPECT_EQ(b.read(kTim3 + SR), before & ~UIF);
  b.write(kTim3 + SR, 0xFFFF);
  EXPECT_EQ(b.read(kTim3 + SR), before & ~UIF);
}

TEST_F(McuTimer, AOnePulseTimerStopsAtTheUpdate) {
  b.write(kTim6 + ARR, 160);
  b.write(kTim6 + CR1, CEN | OPM);
  b.run_cycles(150);
  EXPECT_EQ(b.read(kTim6 + CR1) & CEN, CEN);
  b.run_cycles(30);
  EXPECT_EQ(b.read(kTim6 + CR1) & CEN, 0u);
  EXPECT_EQ(b.read(kTim6 + CNT), 0u);
}

TEST_F(McuTimer, WithPreloadAnArrWrittenWhileRunningHoldsFromTheNextUpdate) {
  b.write(kTim3 + ARR, 999);
  b.write(kTim3 + EGR, 1);
  b.write(kTim3 + CR1, CEN | ARPE);
  b.run_cycles(100);
  b.write(kTim3 + ARR, 99);
  b.write(kTim3 + SR, 0);
  b.run_cycles(800);
  EXPECT_EQ(b.read(kTim3 + SR) & UIF, 0u);
  b.run_cycles(110);
  EXPECT_EQ(b.read(kTim3 + SR) & UIF, UIF);
  b.write(kTim3 + SR, 0);
  b.run_cycles(101);
  EXPECT_EQ(b.read(kTim3 + SR) & UIF, UIF) << "the shorter period is in force";
}

TEST_F(McuTimer, CentreAlignedPwmIsHighForTwiceTheCompareAroundTheTrough) {
  Scope scope(b.chip);
  alternate(8, 6);  // PA8: TIM1_CH1
  b.write(kTim1 + ARR, 1000);
  b.write(kTim1 + CCR1, 300);
  b.write(kTim1 + CCMR1, 0x68);
  b.write(kTim1 + CCER, 1);
  b.write(kTim1 + BDTR, MOE);
  b.write(kTim1 + EGR, 1);
  b.write(kTim1 + CR1, CEN | 3u << 5);
  b.run_cycles(6000);
  const auto edges = scope.of(8);
  ASSERT_GE(edges.size(), 7u);
  for (size_t n = 3; n < 7; ++n) {
    const uint64_t length = edges[n].cycle - edges[n - 1].cycle;
    EXPECT_EQ(length, edges[n].high ? 1400u : 600u) << n;
  }
}

TEST_F(McuTimer, ComplementaryOutputsLeaveTheDeadTimeBetweenThem) {
  Scope scope(b.chip);
  alternate(8, 6);
  alternate(7, 6);  // PA7: TIM1_CH1N
  b.write(kTim1 + ARR, 1000);
  b.write(kTim1 + CCR1, 300);
  b.write(kTim1 + CCMR1, 0x68);
  b.write(kTim1 + CCER, 5);
  b.write(kTim1 + BDTR, MOE | 20);
  b.write(kTim1 + EGR, 1);
  b.write(kTim1 + CR1, CEN | 3u << 5);
  b.run_cycles(6000);
  uint64_t low_ended = 0, high_ended = 0;
  std::vector<uint64_t> gaps;
  for (const Edge& e : scope.edges) {
    if (e.cycle < 2100) continue;
    if (e.pin == 7 && !e.high) low_ended = e.cycle;
    if (e.pin == 8 && !e.high) high_ended = e.cycle;
    if (e.pin == 8 && e.high && low_ended != 0) gaps.push_back(e.cycle - low_ended);
    if (e.pin == 7 && e.high && high_ended != 0) gaps.push_back(e.cycle - high_ended);
  }
  EXPECT_GE(gaps.size(), 3u);
  for (const uint64_t gap : gaps) EXPECT_EQ(gap, 20u);
}

TEST_F(McuTimer, WithRepetitionOneWrittenBeforeTheStartUpdatesComeAtTheTrough) {
  b.write(kTim1 + ARR, 1000);
  b.write(kTim1 + RCR, 1);
  b.write(kTim1 + EGR, 1);
  b.write(kTim1 + SR, 0);
  b.write(kTim1 + CR1, CEN | 3u << 5);
  b.run_cycles(1500);
  EXPECT_EQ(b.read(kTim1 + SR) & UIF, 0u) << "not at the crest";
  b.run_cycles(600);
  EXPECT_EQ(b.read(kTim1 + SR) & UIF, UIF);
}

TEST_F(McuTimer, ABreakInputTakesTheOutputsAwayAndHoldsMoeClear) {
  Scope scope(b.chip);
  alternate(8, 6);
  alternate(6, 6);  // PA6: TIM1_BKIN
  b.chip.set_pin(6, Level::low);
  b.write(kTim1 + ARR, 1000);
  b.write(kTim1 + CCR1, 1001);
  b.write(kTim1 + CCMR1, 0x60);
  b.write(kTim1 + CCER, 1);
  b.write(kTim1 + DIER, BIF);
  b.write(kTim1 + BDTR, MOE | BKE | BKP);
  b.write(kTim1 + CR1, CEN);
  b.run_cycles(100);
  EXPECT_TRUE(scope.of(8).back().high);
  b.chip.set_pin(6, Level::high);
  EXPECT_FALSE(scope.of(8).back().high);
  EXPECT_TRUE(b.line(24));
  b.set(kTim1 + BDTR, MOE);
  EXPECT_EQ(b.read(kTim1 + BDTR) & MOE, 0u) << "the break is still there";
  b.chip.set_pin(6, Level::low);
  b.set(kTim1 + BDTR, MOE);
  EXPECT_EQ(b.read(kTim1 + BDTR) & MOE, MOE);
}

TEST_F(McuTimer, ACaptureTakesTheCounterAndASecondOneUnreadIsAnOvercapture) {
  alternate(15, 1);  // PA15: TIM2_CH1
  b.chip.set_pin(15, Level::low);
  b.write(kTim2 + CCMR1, 1);
  b.write(kTim2 + CCER, 1);
  b.write(kTim2 + CR1, CEN);
  b.run_cycles(1000);
  b.chip.set_pin(15, Level::high);
  EXPECT_EQ(b.read(kTim2 + SR) & CC1IF, CC1IF);
  EXPECT_NEAR(b.read(kTim2 + CCR1), 1000, 8);
  EXPECT_EQ(b.read(kTim2 + SR) & CC1IF, 0u) << "reading the capture clears its flag";
  b.chip.set_pin(15, Level::low);
  b.chip.set_pin(15, Level::high);
  b.chip.set_pin(15, Level::low);
  b.chip.set_pin(15, Level::high);
  EXPECT_EQ(b.read(kTim2 + SR) & CC1OF, CC1OF);
}

TEST_F(McuTimer, Tim1InTriggerModeIsStartedByTheUpdateOfTim2) {
  b.write(kTim1 + ARR, 1000);
  b.write(kTim1 + SMCR, 0x16);
  b.write(kTim2 + ARR, 499);
  b.write(kTim2 + CR2, 2u << 4);
  b.write(kTim2 + CR1, CEN);
  b.run_cycles(400);
  EXPECT_EQ(b.read(kTim1 + CR1) & CEN, 0u);
  b.run_cycles(200);
  EXPECT_EQ(b.read(kTim1 + CR1) & CEN, CEN);
  EXPECT_EQ(b.read(kTim1 + SR) & TIF, TIF);
}

TEST_F(McuTimer, AnUpdateInterruptThatIsNotClearedIsNotLatchedAgain) {
  b.write(kTim3 + ARR, 99);
  b.write(kTim3 + DIER, 1);
  b.write(kTim3 + CR1, CEN);
  b.run_cycles(150);
  EXPECT_TRUE(b.line(29));
  b.chip.core().state.nvic.pending.set(kFirstInterrupt + 29, false);
  b.run_cycles(500);
  EXPECT_FALSE(b.pending(29)) << "no new edge without clearing the flag";
  b.write(kTim3 + SR, 0);
  b.run_cycles(150);
  EXPECT_TRUE(b.pending(29));
}

TEST_F(McuTimer, WithCcpcEnablesWaitForTheComEvent) {
  Scope scope(b.chip);
  alternate(8, 6);
  b.write(kTim1 + ARR, 1000);
  b.write(kTim1 + CCR1, 1001);
  b.write(kTim1 + CCMR1, 0x60);
  b.write(kTim1 + CR2, 1);
  b.write(kTim1 + CCER, 1);
  b.write(kTim1 + BDTR, MOE);
  b.write(kTim1 + CR1, CEN);
  b.run_cycles(50);
  EXPECT_TRUE(scope.of(8).empty() || !scope.of(8).back().high);
  b.write(kTim1 + EGR, COMIF);
  EXPECT_TRUE(scope.of(8).back().high);
}

TEST_F(McuTimer, AHundredSecondsUnheardCostNothingAndTheCounterIsRight) {
  b.write(kTim3 + ARR, 9);
  b.write(kTim3 + CR1, CEN);
  b.chip.core().state.cycle += 1'600'000'003;
  EXPECT_LE(b.read(kTim3 + CNT), 9u);
  EXPECT_EQ(b.read(kTim3 + SR) & UIF, UIF);
}

TEST_F(McuTimer, DirShowsWhichWayACentreAlignedCounterGoes) {
  b.write(kTim1 + ARR, 512);
  b.write(kTim1 + CR1, CEN | 3u << 5);
  b.run_cycles(700);
  EXPECT_EQ(b.read(kTim1 + CR1) & DIR, DIR) << "on the way down";
  b.run_cycles(500);
  EXPECT_EQ(b.read(kTim1 + CR1) & DIR, 0u);
}

}  // namespace
}  // namespace rotorloop::mcu::g431::testing
