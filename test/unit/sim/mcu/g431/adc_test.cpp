// ADC, sentence by sentence of RM0440, chapter 21, and DMA from it. HCLK is 16 MHz, the converters run from it.
#include "test/unit/sim/mcu/g431/bench.hpp"

namespace rotorloop::mcu::g431::testing {
namespace {

constexpr uint32_t kAdc1 = 0x50000000, kAdc2 = 0x50000100, kCommon = 0x50000300;
constexpr uint32_t ISR = 0x00, IER = 0x04, CR = 0x08, CFGR = 0x0C, TR1 = 0x20, SQR1 = 0x30, DR = 0x40, JSQR = 0x4C, JDR1 = 0x80;
constexpr uint32_t ADEN = 1, ADSTART = 4, JADSTART = 8, JADSTP = 32, kJqdis = 1u << 31;

class McuAdc : public ::testing::Test, public Pins {
 protected:
  McuAdc() {
    b.clock_everything();
    b.chip.pins = this;
    b.write(kCommon + 8, 1u << 16);
    on(kAdc1);
  }
  double pin_V(uint32_t pin) override { return pin < 8 ? 0.4 * pin + 0.1 : 0.0; }
  void on(uint32_t adc) {
    b.write(adc + CR, 1u << 28);
    b.write(adc + CR, 1u << 28 | 1u << 31);
    b.run_us(20);
    b.write(adc + CR, 1u << 28 | ADEN);
    b.run_us(5);
    EXPECT_EQ(b.read(adc + ISR) & 1, 1u) << "ADRDY";
  }
  static uint32_t counts(double volts) { return static_cast<uint32_t>(volts * 4096.0 / 3.3); }
  Bench b;
};

TEST_F(McuAdc, CalibrationClearsItsBitWhenItIsDoneAndWritingZeroToASetOnlyBitDoesNothing) {
  EXPECT_EQ(b.read(kAdc1 + CR) >> 31, 0u);
  b.write(kAdc1 + CR, 0);
  EXPECT_EQ(b.read(kAdc1 + CR) & ADEN, ADEN);
}

TEST_F(McuAdc, ARegularSequenceConvertsItsRanksInOrderAndEndsWithEos) {
  b.write(kAdc1 + SQR1, 1 | 2u << 6 | 4u << 12);  // PA1, PA3
  b.write(kAdc1 + CR, ADSTART);
  b.run_cycles(17);
  EXPECT_EQ(b.read(kAdc1 + ISR) & 0xC, 4u) << "EOC of the first, after 2.5 + 12.5 cycles";
  EXPECT_EQ(b.read(kAdc1 + DR), counts(0.5));
  EXPECT_EQ(b.read(kAdc1 + ISR) & 0x4, 0u) << "reading DR clears EOC";
  b.run_cycles(16);
  EXPECT_EQ(b.read(kAdc1 + ISR) & 0xC, 0xCu);
  EXPECT_EQ(b.read(kAdc1 + DR), counts(1.3));
  EXPECT_EQ(b.read(kAdc1 + CR) & ADSTART, 0u) << "single mode by software";
}

TEST_F(McuAdc, LeftAlignedDataAreSixteenTimesAsLarge) {
  b.write(kAdc1 + CFGR, kJqdis | 1u << 15);
  b.write(kAdc1 + SQR1, 2u << 6);
  b.write(kAdc1 + CR, ADSTART);
  b.run_us(3);
  EXPECT_EQ(b.read(kAdc1 + DR), counts(0.5) << 4);
}

TEST_F(McuAdc, InjectedChannelsFollowTheirTriggersEdgeAndInterruptTheRegularSequence) {
  b.write(kAdc1 + 0x14, 7u << 6);  // channel 2: 640.5 cycles
  b.write(kAdc1 + SQR1, 2u << 6);
  b.write(kAdc1 + JSQR, 0u | 0u << 2 | 2u << 7 | 4u << 9);  // TIM1_TRGO, falling edge, PA3
  b.write(kAdc1 + CR, JADSTART | ADSTART);
  b.run_cycles(100);
  b.chip.set_signal(timer_signal(1, TimerWire::trgo), true);
  b.run_cycles(30);
  EXPECT_EQ(b.read(kAdc1 + ISR) & 0x60, 0u) << "not the rising edge";
  b.chip.set_signal(timer_signal(1, TimerWire::trgo), false);
  b.run_cycles(20);
  EXPECT_EQ(b.read(kAdc1 + ISR) & 0x60, 0x60u);
  EXPECT_EQ(b.read(kAdc1 + JDR1), counts(1.3));
  EXPECT_EQ(b.read(kAdc1 + CR) & JADSTART, JADSTART) << "with a hardware trigger it stays started";
  b.run_cycles(540);
  EXPECT_EQ(b.read(kAdc1 + ISR) & 4, 0u) << "the regular conversion began again after the injected one";
  b.run_cycles(120);
  EXPECT_EQ(b.read(kAdc1 + ISR) & 4, 4u);
}

TEST_F(McuAdc, WithTheQueueContextsFollowEachOtherAThirdOverflowsAndJadstpEmptiesIt) {
  b.write(kAdc1 + CFGR, 0);  // JQDIS = 0, JQM = 0
  const uint32_t first = 1u << 7 | 2u << 9, second = 1u << 7 | 4u << 9;
  b.write(kAdc1 + JSQR, first);
  b.write(kAdc1 + JSQR, second);
  EXPECT_EQ(b.read(kAdc1 + ISR) & 0x400, 0u);
  b.write(kAdc1 + JSQR, first);
  EXPECT_EQ(b.read(kAdc1 + ISR) & 0x400, 0x400u) << "JQOVF";
  b.write(kAdc1 + CR, JADSTART);
  b.chip.pulse(timer_signal(1, TimerWire::trgo));
  b.run_us(3);
  EXPECT_EQ(b.read(kAdc1 + JDR1), counts(0.5));
  EXPECT_EQ(b.read(kAdc1 + JSQR), second);
  b.chip.pulse(timer_signal(1, TimerWire::trgo));
  b.run_us(3);
  EXPECT_EQ(b.read(kAdc1 + JDR1), counts(1.3));
  EXPECT_EQ(b.read(kAdc1 + JSQR), second) << "JQM = 0: the last context stays";
  b.write(kAdc1 + CR, JADSTP);
  EXPECT_EQ(b.read(kAdc1 + JSQR), 0u);
  EXPECT_EQ(b.read(kAdc1 + CR) & JADSTART, 0u);
}

TEST_F(McuAdc, WithJqmTheQueueIsEmptyAfterItsLastContextAndTriggersAreLost) {
  b.write(kAdc1 + CFGR, 1u << 21);
  b.write(kAdc1 + JSQR, 1u << 7 | 2u << 9);
  b.write(kAdc1 + CR, JADSTART);
  b.chip.pulse(timer_signal(1, TimerWire::trgo));
  b.run_us(3);
  EXPECT_EQ(b.read(kAdc1 + JSQR), 0u);
  b.write(kAdc1 + ISR, 0x60);
  b.chip.pulse(timer_signal(1, TimerWire::trgo));
  b.run_us(3);
  EXPECT_EQ(b.read(kAdc1 + ISR) & 0x60, 0u);
}

TEST_F(McuAdc, AnAnalogWatchdogFlagsWhatLeavesItsWindowAndRaisesItsOutput) {
  b.write(kAdc1 + TR1, 100u | counts(1.0) << 16);
  b.write(kAdc1 + CFGR, kJqdis | 1u << 22 | 1u << 23 | 2u << 26);
  b.write(kAdc1 + SQR1, 2u << 6);
  b.write(kAdc1 + CR, ADSTART);
  b.run_us(3);
  EXPECT_EQ(b.read(kAdc1 + ISR) & 0x80, 0u) << "0.5 V is inside";
  b.write(kAdc1 + TR1, 100u | counts(0.4) << 16);
  b.write(kAdc1 + CR, ADSTART);
  b.run_us(3);
  EXPECT_EQ(b.read(kAdc1 + ISR) & 0x80, 0x80u);
  EXPECT_TRUE(b.chip.signal(Signal::adc1_awd1));
}

TEST_F(McuAdc, TheAmplifierWithGainSixteenIsTheInternalChannel13) {
  b.write(0x40010300, 1u | 2u << 5 | 3u << 14 | 1u << 8);  // PA1, PGA x16, internal output
  b.write(kAdc1 + SQR1, 13u << 6);
  b.write(kAdc1 + CR, ADSTART);
  b.run_us(3);
  EXPECT_EQ(b.read(kAdc1 + DR), 4095u) << "16 times 0.5 V is clipped at the supply";
  b.write(0x40010300, 1u | 2u << 5 | 1u << 14 | 1u << 8);
  b.write(kAdc1 + CR, ADSTART);
  b.run_us(3);
  EXPECT_EQ(b.read(kAdc1 + DR), counts(2.0));
}

TEST_F(McuAdc, DmaTakesEachResultAndTellsHalfAndEndOfACircle) {
  b.write(0x40020800, 5);  // DMAMUX channel 0: ADC1
  b.write(0x40020010, kAdc1 + DR);
  b.write(0x40020014, kSramBase + 0x100);
  b.write(0x4002000C, 4);
  b.write(0x40020008, 1u | 2u | 4u | 32u | 128u | 1u << 8 | 1u << 10);  // EN TCIE HTIE CIRC MINC, 16 bits
  b.write(kAdc1 + CFGR, kJqdis | 3u);
  b.write(kAdc1 + SQR1, 1 | 2u << 6 | 4u << 12);
  b.write(kAdc1 + CR, ADSTART);
  b.run_us(6);
  EXPECT_EQ(b.read(0x40020000) & 6, 4u) << "half";
  EXPECT_TRUE(b.line(11));
  b.write(0x40020004, 1);
  b.write(kAdc1 + CR, ADSTART);
  b.run_us(6);
  EXPECT_EQ(b.read(0x40020000) & 6, 2u) << "complete";
  EXPECT_EQ(b.read(0x4002000C), 4u);
  uint16_t data[4];
  std::memcpy(data, b.chip.memory(kSramBase + 0x100, 8), 8);
  EXPECT_EQ(data[2], counts(0.5));
  EXPECT_EQ(data[3], counts(1.3));
}

TEST_F(McuAdc, BothConvertersShareOneInterruptLine) {
  on(kAdc2);
  b.write(kAdc1 + ISR, 0x7FF);
  b.write(kAdc2 + ISR, 0x7FF);
  b.write(kAdc1 + IER, 4);
  b.write(kAdc2 + IER, 4);
  b.write(kAdc1 + CR, ADSTART);
  b.write(kAdc2 + CR, ADSTART);
  b.run_us(3);
  EXPECT_TRUE(b.line(18));
  b.read(kAdc1 + DR);
  EXPECT_TRUE(b.line(18)) << "ADC2 still holds it";
  b.read(kAdc2 + DR);
  EXPECT_FALSE(b.line(18));
}

}  // namespace
}  // namespace rotorloop::mcu::g431::testing
