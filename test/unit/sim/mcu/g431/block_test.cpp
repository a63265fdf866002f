// The other blocks, sentence by sentence of RM0440.
#include <cmath>

#include "test/unit/sim/mcu/g431/bench.hpp"

namespace rotorloop::mcu::g431::testing {
namespace {

constexpr uint32_t kGpioA = 0x48000000, kExti = 0x40010400, kIwdg = 0x40003000, kWwdg = 0x40002C00, kCrc = 0x40023000, kCordic = 0x40020C00,
                   kUsart2 = 0x40004400, kTamp = 0x40002400, kPwr = 0x40007000;

class McuBlock : public ::testing::Test, public Pins {
 protected:
  McuBlock() {
    b.clock_everything();
    b.chip.pins = this;
  }
  void on_uart(uint32_t number, uint8_t byte) override {
    if (number == 2) sent.push_back({b.chip.now(), byte});
  }
  double pin_V(uint32_t pin) override { return pin == 1 ? plus_V : 0.0; }
  std::vector<std::pair<uint64_t, uint8_t>> sent;
  double plus_V = 0.0;
  Bench b;
};

TEST_F(McuBlock, GpioModesAndPullsAfterResetAreThoseOfTheDebugPins) {
  EXPECT_EQ(b.read(kGpioA), 0xABFFFFFFu);
  EXPECT_EQ(b.read(kGpioA + 0x0C), 0x64000000u);
}

TEST_F(McuBlock, BsrrSetsAndResetsAndSettingWins) {
  b.write(kGpioA, (b.read(kGpioA) & ~0xFu) | 0x5);
  b.write(kGpioA + 0x18, 1u | 3u << 16);
  EXPECT_EQ(b.read(kGpioA + 0x14), 1u);
  EXPECT_EQ(b.read(kGpioA + 0x10) & 3, 1u) << "IDR reads the pin back";
  b.write(kGpioA + 0x28, 1);
  EXPECT_EQ(b.read(kGpioA + 0x14), 0u);
}

TEST_F(McuBlock, APullUpHoldsAnOpenInputHighUntilItIsPulledLow) {
  b.write(kGpioA, b.read(kGpioA) & ~0xC0u);
  b.write(kGpioA + 0x0C, 0x40);
  EXPECT_EQ(b.read(kGpioA + 0x10) & 8, 8u);
  b.chip.set_pin(3, Level::low);
  EXPECT_EQ(b.read(kGpioA + 0x10) & 8, 0u);
}

TEST_F(McuBlock, AnEdgeOfTheSelectedPortPendsItsLineUntilOneIsWritten) {
  const uint32_t c = kGpioA + 0x800;
  b.write(c, b.read(c) & ~(3u << 20));
  b.write(0x40010010, 2u << 8);  // EXTICR3: line 10 from port C
  b.set(kExti + 0x00, 1u << 10);
  b.write(kExti + 0x0C, 1u << 10);
  b.chip.set_pin(42, Level::high);
  EXPECT_FALSE(b.line(40)) << "a rising edge is not selected";
  b.chip.set_pin(42, Level::low);
  EXPECT_TRUE(b.line(40));
  EXPECT_EQ(b.read(kExti + 0x14), 1u << 10);
  b.write(kExti + 0x14, 1u << 10);
  EXPECT_FALSE(b.line(40));
}

TEST_F(McuBlock, TheIndependentWatchdogResetsAfterItsTimeAndSaysSo) {
  b.write(kIwdg, 0xCCCC);
  b.write(kIwdg, 0x5555);
  b.write(kIwdg + 4, 1);    // 32 kHz / 8
  b.write(kIwdg + 8, 399);  // 100 ms
  EXPECT_NE(b.read(kIwdg + 0xC), 0u) << "the new values are on their way";
  b.run_us(1000);
  EXPECT_EQ(b.read(kIwdg + 0xC), 0u);
  b.write(kIwdg, 0xAAAA);
  b.run_us(99'000);
  EXPECT_EQ(b.chip.resets(), 0u);
  b.write(kIwdg, 0xAAAA);
  b.run_us(99'000);
  EXPECT_EQ(b.chip.resets(), 0u);
  b.run_us(2'000);
  EXPECT_EQ(b.chip.resets(), 1u);
  EXPECT_EQ(b.read(kRcc + 0x94) >> 29 & 1, 1u) << "IWDGRSTF";
}

TEST_F(McuBlock, TheWindowWatchdogWarnsAt0x40AndResetsBelow) {
  b.write(kWwdg + 4, 0x7F | 1u << 9);
  b.write(kWwdg, 0x80 | 0x50);
  b.run_us(16.1 * 256);  // 16 steps of 4096 cycles at 16 MHz
  EXPECT_TRUE(b.line(0));
  EXPECT_EQ(b.chip.resets(), 0u);
  b.run_us(256);
  EXPECT_EQ(b.chip.resets(), 1u);
  EXPECT_EQ(b.read(kRcc + 0x94) >> 30 & 1, 1u);
}

TEST_F(McuBlock, BackupRegistersNeedDbpAndOutliveAResetOfTheSystem) {
  b.write(kTamp + 0x100, 0x1234);
  EXPECT_EQ(b.read(kTamp + 0x100), 0u);
  b.set(kPwr, 1u << 8);
  b.write(kTamp + 0x100, 0x1234);
  b.chip.reset_chip(kSoftwareReset);
  b.run_us(1);
  EXPECT_EQ(b.chip.resets(), 1u);
  EXPECT_EQ(b.read(kTamp + 0x100), 0x1234u);
}

TEST_F(McuBlock, TheCrcOfTheCheckStringIsThatOfItsPolynomials) {
  b.write(kCrc + 8, 1);
  for (const char c : std::string("123456789")) b.write(kCrc, static_cast<uint8_t>(c), 1);
  EXPECT_EQ(b.read(kCrc), 0x0376E6E7u) << "CRC-32/MPEG-2";
  b.write(kCrc + 8, 1 | 1u << 5 | 1u << 7);
  for (const char c : std::string("123456789")) b.write(kCrc, static_cast<uint8_t>(c), 1);
  EXPECT_EQ(~b.read(kCrc), 0xCBF43926u) << "CRC-32";
  b.write(kCrc + 0x14, 0x1021);
  b.write(kCrc + 0x10, 0xFFFF);
  b.write(kCrc + 8, 1 | 1u << 3);
  for (const char c : std::string("123456789")) b.write(kCrc, static_cast<uint8_t>(c), 1);
  EXPECT_EQ(b.read(kCrc), 0x29B1u) << "CRC-16/CCITT-FALSE";
}

TEST_F(McuBlock, TheCordicGivesCosineAndSineOfAQ31AngleAndOfAQ15AngleInOneWord) {
  b.write(kCordic, 0 | 6u << 4 | 1u << 19);
  b.write(kCordic + 4, 0x20000000);  // pi / 4
  EXPECT_NEAR(static_cast<int32_t>(b.read(kCordic + 8)) / 2147483648.0, std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(static_cast<int32_t>(b.read(kCordic + 8)) / 2147483648.0, std::sqrt(0.5), 1e-6);
  b.write(kCordic, 0 | 6u << 4 | 1u << 21 | 1u << 22);
  b.write(kCordic + 4, 0x7FFF0000u | 0x1555u);  // 30 degrees
  const uint32_t both = b.read(kCordic + 8);
  EXPECT_NEAR(static_cast<int16_t>(both) / 32768.0, std::sqrt(0.75), 2e-4);
  EXPECT_NEAR(static_cast<int16_t>(both >> 16) / 32768.0, 0.5, 2e-4);
  b.write(kCordic, 9 | 6u << 4);
  b.write(kCordic + 4, 0x20000000);
  EXPECT_NEAR(static_cast<int32_t>(b.read(kCordic + 8)) / 2147483648.0, 0.5, 1e-6);
}

TEST_F(McuBlock, AUartFrameTakesTenBitsAndTheFlagsFollow) {
  b.write(kUsart2 + 0x0C, 139);  // 115 108 baud
  b.write(kUsart2, 1 | 4 | 8);
  EXPECT_EQ(b.read(kUsart2 + 0x1C) & 0xC0, 0xC0u);
  const uint64_t begun = b.chip.cycle();
  b.write(kUsart2 + 0x28, 'A');
  EXPECT_EQ(b.read(kUsart2 + 0x1C) & 0xC0, 0x80u) << "TDR is free at once, the frame is not out";
  b.run_us(100);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].second, 'A');
  EXPECT_NEAR(static_cast<double>(sent[0].first - begun), 1390, 3);
  EXPECT_EQ(b.read(kUsart2 + 0x1C) & 0x40, 0x40u);
}

TEST_F(McuBlock, AReceivedByteUnreadIsAnOverrunAndThenAnIdleLine) {
  b.write(kUsart2 + 0x0C, 139);
  b.write(kUsart2, 1 | 4 | 8);
  b.chip.blocks().usarts[1].receive('x');
  EXPECT_EQ(b.read(kUsart2 + 0x1C) & 0x28, 0x20u);
  b.chip.blocks().usarts[1].receive('y');
  EXPECT_EQ(b.read(kUsart2 + 0x1C) & 0x28, 0x28u);
  b.run_us(100);
  EXPECT_EQ(b.read(kUsart2 + 0x1C) & 0x10, 0x10u);
  EXPECT_EQ(b.read(kUsart2 + 0x24), static_cast<uint32_t>('x'));
}

TEST_F(McuBlock, AComparatorAgainstTheDacRaisesItsOutputAndItsExtiLine) {
  b.write(0x50001000, 1);
  b.write(0x50001008, 2048);          // DAC3 channel 1: 1.65 V
  b.write(0x40010200, 1u | 4u << 4);  // COMP1: PA1 against DAC3_CH1
  b.set(kExti, 1u << 21);
  b.write(kExti + 8, 1u << 21);
  plus_V = 1.7;
  EXPECT_EQ(b.read(0x40010200) >> 30 & 1, 1u);
  EXPECT_TRUE(b.chip.signal(Signal::comp1_out));
  EXPECT_TRUE(b.line(64));
  plus_V = 1.6;
  EXPECT_EQ(b.read(0x40010200) >> 30 & 1, 0u);
}

TEST_F(McuBlock, ABlockWhoseClockIsOffReadsZeroAndTakesNothing) {
  b.clear(kRcc + 0x58, 1u << 17);
  b.write(kUsart2 + 0x0C, 139);
  EXPECT_EQ(b.read(kUsart2 + 0x0C), 0u);
  EXPECT_EQ(b.chip.unclocked_count(), 2u);
}

}  // namespace
}  // namespace rotorloop::mcu::g431::testing
