// RCC and what the chip itself promises: clock tree, ready flags, gates, refusals, resets, snapshots (RM0440, 2, 7).
#include "test/unit/sim/mcu/g431/bench.hpp"

namespace rotorloop::mcu::g431::testing {
namespace {

TEST(McuClock, AfterResetTheChipRunsFrom16MHzHsi) {
  Bench b;
  EXPECT_EQ(b.read(kRcc), 0x500u);
  EXPECT_EQ(b.read(kRcc + 8), 5u);
  EXPECT_EQ(b.chip.clocks().hclk_Hz, 16'000'000u);
}

TEST(McuClock, CrystalAndPllBecomeReadyAfterTheirTimeAndGive170MHz) {
  Bench b;
  b.set(kRcc, 1u << 16);
  b.run_us(1990);
  EXPECT_EQ(b.read(kRcc) >> 17 & 1, 0u) << "2 ms typical";
  b.run_us(20);
  EXPECT_EQ(b.read(kRcc) >> 17 & 1, 1u);
  b.write(kRcc + 0x0C, 3u | 1u << 4 | 85u << 8 | 1u << 24);
  b.set(kRcc, 1u << 24);
  b.write(kRcc + 0x08, 3);
  EXPECT_EQ(b.read(kRcc + 8) >> 2 & 3, 1u) << "SWS follows when the PLL has locked, not before";
  b.run_us(20);
  EXPECT_EQ(b.read(kRcc + 8) >> 2 & 3, 3u);
  EXPECT_EQ(b.chip.clocks().hclk_Hz, 170'000'000u);
}

TEST(McuClock, WhatDrivesTheSystemCannotBeSwitchedOffAndPllFactorsStandWhileItRuns) {
  Bench b;
  b.run_at_170_MHz();
  b.clear(kRcc, 1u << 24 | 1u << 16);
  EXPECT_EQ(b.read(kRcc) >> 24 & 3, 3u);
  EXPECT_EQ(b.read(kRcc) >> 16 & 3, 3u);
  b.write(kRcc + 0x0C, 0);
  EXPECT_EQ(b.read(kRcc + 0x0C) & 0x7FF3, 3u | 1u << 4 | 85u << 8);
}

TEST(McuClock, TimersRunTwiceAsFastAsADividedApb) {
  Bench b;
  b.run_at_170_MHz();
  b.write(kRcc + 8, 3 | 5u << 8);  // APB1 by 4
  EXPECT_EQ(b.chip.clocks().pclk1_Hz, 42'500'000u);
  EXPECT_EQ(b.chip.clocks().tim1_Hz, 85'000'000u);
  EXPECT_EQ(b.chip.clocks().tim2_Hz, 170'000'000u);
}

TEST(McuClock, ALostCrystalSwitchesToHsiAndRaisesNmi) {
  Bench b;
  b.run_at_170_MHz();
  b.set(kRcc, 1u << 19);
  b.chip.set_signal(Signal::clock_failed, true);
  EXPECT_EQ(b.chip.clocks().hclk_Hz, 16'000'000u);
  EXPECT_EQ(b.read(kRcc + 0x1C) & 0x100, 0x100u);
  EXPECT_TRUE(b.chip.core().state.nvic.pending.has(kNmi));
}

TEST(McuClock, SecondsGoOnThroughAChangeOfClock) {
  Bench b;
  b.run_us(1000);
  const double before = b.chip.time_s();
  b.run_at_170_MHz();
  b.run_us(1000);
  EXPECT_NEAR(b.chip.time_s() - before, 3.6e-3, 1e-6);
}

TEST(McuChip, ARegisterThatDoesNotExistIsRefusedByBlockValueAndPlace) {
  Bench b;
  b.write(kRcc + 0x14, 0x1234);
  EXPECT_EQ(b.run_us(1), End::refused);
  EXPECT_NE(text(b.chip.refused()).find("RCC at 0x40021014, write of 4 bytes of 0x1234"), std::string::npos) << text(b.chip.refused());
}

TEST(McuChip, ABlockThatIsNotBuiltSaysItsNameAndLenientCounts) {
  Bench b;
  b.chip.lenient = true;
  EXPECT_EQ(b.read(0x50060800), 0u);
  EXPECT_EQ(b.run_us(1), End::at_cycle);
  EXPECT_EQ(b.chip.refused_count(), 1u);
  EXPECT_STREQ(b.chip.refused().block, "RNG");
}

TEST(McuChip, WhereNothingIsABusFaultAnswers) {
  Bench b;
  uint32_t value = 0;
  EXPECT_FALSE(b.chip.read(0x60000000, 4, value));
  EXPECT_FALSE(b.chip.read(0x40030000, 4, value));
}

TEST(McuChip, FlashIsAtZeroTooAndCcmBehindSram2) {
  Bench b;
  EXPECT_EQ(b.chip.memory(0xFE0, 4), b.chip.memory(kFlashBase + 0xFE0, 4));
  EXPECT_EQ(b.chip.memory(0x20005800, 4), b.chip.memory(kCcmBase, 4));
  EXPECT_EQ(b.chip.memory(0x20008000, 1), nullptr);
  uint16_t kilobytes = 0;
  std::memcpy(&kilobytes, b.chip.memory(0x1FFF75E0, 2), 2);
  EXPECT_EQ(kilobytes, 128);
}

TEST(McuChip, ASnapshotPutBackGoesOnWithTheSameBytes) {
  Bench b;
  b.set(kRcc, 1u << 16);
  b.run_us(500);
  const auto middle = b.chip.snapshot();
  b.run_us(3000);
  const auto end = b.chip.snapshot();
  b.chip.restore(middle);
  EXPECT_EQ(b.read(kRcc) >> 17 & 1, 0u);
  b.run_us(3000);
  EXPECT_EQ(b.chip.snapshot(), end);
}

}  // namespace
}  // namespace rotorloop::mcu::g431::testing
