// FDCAN1's error states, loop back and silent modes, and its time stamps, sentence by sentence of RM0440, section 44.
#include "test/unit/sim/mcu/g431/fdcan_bench.hpp"

namespace rotorloop::mcu::g431::testing {
namespace {

TEST(McuFdcan, AloneOnTheBusItGoesPassiveForMissingAcknowledgesAndNotOff) {
  CanBench b(alone());
  b.send(0, frame(0x100));
  b.run_us(62);
  EXPECT_EQ(b.read(PSR) & 7, 3u) << "LEC: acknowledge";
  EXPECT_EQ(b.read(PSR) & 7, 7u) << "reading sets it to no change";
  b.run_us(20000);
  EXPECT_EQ(b.read(ECR) & 0xFF, 128u);
  EXPECT_EQ(b.read(PSR) >> 5 & 7, 3u) << "warning and passive, not off";
  EXPECT_EQ(b.read(IR) >> 17 & 7, 3u);
  EXPECT_EQ(b.read(TXBRP), 1u);
}

TEST(McuFdcan, AfterThirtyTwoDestroyedFramesItIsOffAndInInitAndReturnsAfter129SequencesOf11RecessiveBits) {
  CanBench b({{.kind = sim::BusFaultKind::corrupt, .port = 0, .at_ns = 0, .duration_ns = 20'000'000, .error_bit = 20}});
  b.send(0, frame(0x100));
  b.run_us(5000);
  EXPECT_EQ(b.on_bus.size(), 32u);
  EXPECT_EQ(b.read(PSR) >> 7 & 1, 1u);
  EXPECT_EQ(b.read(CCCR) & 1, 1u) << "the hardware sets INIT";
  EXPECT_EQ(b.read(IR) >> 19 & 1, 1u);
  b.run_us(20000);
  EXPECT_EQ(b.read(PSR) >> 7 & 1, 1u) << "it waits for software";
  b.write(IR, 1u << 19);
  b.write(CCCR, 0);
  b.run_us(129 * 11 - 2);
  EXPECT_EQ(b.read(PSR) >> 7 & 1, 1u);
  EXPECT_EQ(b.read(PSR) & 7, 7u);
  b.run_us(4);
  EXPECT_EQ(b.read(PSR) >> 7 & 1, 0u);
  EXPECT_EQ(b.read(ECR), 32u << 16) << "counters are 0; 32 errors logged";
  EXPECT_EQ(b.read(IR) >> 19 & 1, 1u);
  b.run_us(100);
  EXPECT_EQ(b.ids(), (std::vector<uint32_t>{0x100})) << "the request was kept";
}

TEST(McuFdcan, FramesOfOthersCountTowardsTheEndOfBusOff) {
  CanBench b({{.kind = sim::BusFaultKind::corrupt, .port = 0, .at_ns = 0, .duration_ns = 20'000'000, .error_bit = 20}});
  b.send(0, frame(0x100));
  b.run_us(20000);
  b.write(CCCR, 0);
  for (int n = 0; n < 5; ++n) b.hear(frame(0x20));
  EXPECT_EQ(b.read(PSR) >> 7 & 1, 1u);
  EXPECT_EQ(b.read(RXF0S) & 15, 0u) << "while off it receives nothing";
  b.run_us(129 * 11);
  b.hear(frame(0x20));
  EXPECT_EQ(b.read(RXF0S) & 15, 1u);
}

TEST(McuFdcan, DestroyedFramesOfOthersRaiseTheReceiveCounterByOne) {
  CanBench b({{.kind = sim::BusFaultKind::corrupt, .port = 1, .at_ns = 0, .max_count = 3, .error_bit = 20}});
  b.hear(frame(0x20));
  b.run_us(1000);
  EXPECT_EQ(b.read(ECR), 3u << 16 | 2u << 8) << "three errors, and one off for the good frame";
  EXPECT_EQ(b.read(IR) >> 21 & 1, 1u) << "PEA";
}

TEST(McuFdcan, Section44_3_3_InternalLoopBackKeepsFramesOffTheBus) {
  CanBench b;
  b.configure([&] { b.write(TEST, 1u << 4); }, 1u << 7 | 1u << 5);
  const CanFrame f = frame(0x321, {9, 8, 7});
  b.send(0, f);
  b.run_us(frame_bits(f) - 2);
  EXPECT_EQ(b.read(RXF0S) & 15, 0u);
  b.run_us(4);
  EXPECT_EQ(b.read(RXF0S) & 15, 1u);
  EXPECT_EQ(b.read(kRx0 + 8) & 0xFFFFFF, 0x070809u);
  EXPECT_TRUE(b.on_bus.empty());
}

TEST(McuFdcan, Section44_3_3_ExternalLoopBackSendsHearsItselfAndNeedsNoAcknowledge) {
  CanBench b(alone());
  b.configure([&] { b.write(TEST, 1u << 4); }, 1u << 7);
  b.send(0, frame(0x321));
  b.run_us(100);
  EXPECT_EQ(b.ids(), (std::vector<uint32_t>{0x321}));
  EXPECT_EQ(b.read(RXF0S) & 15, 1u);
  EXPECT_EQ(b.read(ECR), 0u);
}

TEST(McuFdcan, Section44_3_3_BusMonitoringReceivesAndNeitherSendsNorAcknowledges) {
  CanBench b({{.kind = sim::BusFaultKind::unplugged, .port = 2, .at_ns = 0, .duration_ns = 20'000'000}});
  b.configure([] {}, 1u << 5);
  b.send(0, frame(0x001));
  b.hear(frame(0x20));
  EXPECT_EQ(b.read(TXBRP), 1u);
  EXPECT_TRUE(b.ids().empty()) << "nobody acknowledged";
  b.run_us(20000);
  EXPECT_EQ(b.ids(), (std::vector<uint32_t>{0x20})) << "the third node does";
  EXPECT_EQ(b.read(RXF0S) & 15, 1u);
}

TEST(McuFdcan, Section44_3_3_RestrictedOperationAcknowledgesAndSendsNothing) {
  CanBench b;
  b.configure([] {}, 1u << 2);
  b.send(0, frame(0x001));
  b.hear(frame(0x20));
  EXPECT_EQ(b.ids(), (std::vector<uint32_t>{0x20}));
  EXPECT_EQ(b.read(RXF0S) & 15, 1u);
}

TEST(McuFdcan, ANodeAtTheWrongBitRateHearsNothingAndDestroysWhatItMeets) {
  CanBench b;
  b.configure([] {}, 0, 19u << 16 | 13u << 8 | 1u);  // 500 kbit/s
  b.send(0, frame(0x100));
  b.run_us(5000);
  EXPECT_TRUE(b.ids().empty());
  EXPECT_EQ(b.read(PSR) >> 7 & 1, 1u) << "bus-off";
  b.hear(frame(0x20));
  EXPECT_EQ(b.read(RXF0S) & 15, 0u);
  EXPECT_EQ(b.ids(), (std::vector<uint32_t>{0x20})) << "off, it disturbs nobody any more";
}

TEST(McuFdcan, Section44_3_2_TheTimeStampCounterCountsBitTimesAndWraps) {
  CanBench b;
  b.configure([&] { b.write(TSCC, 1u | 1u << 16); });  // every second bit
  b.write(TSCV, 0);
  b.run_us(1000);
  EXPECT_NEAR(b.read(TSCV), 500, 1);
  b.write(IR, 1u << 13);
  b.run_us(131072 - 1000);
  EXPECT_EQ(b.read(IR) >> 13 & 1, 1u);
  EXPECT_LE(b.read(TSCV), 1u);
}

TEST(McuFdcan, RemoteAndFdFramesAreRefusedByName) {
  CanBench b;
  b.write(kTx, 1u << 29);
  b.write(TXBAR, 1);
  EXPECT_EQ(b.run_us(1), End::refused);
  EXPECT_STREQ(b.chip.refused().why, "remote frames are not built: no bus here carries them");
  EXPECT_STREQ(b.chip.refused().reg, "TXBAR");
}

TEST(McuFdcan, TheMessageRamTakesWordsOnly) {
  Bench b;
  b.clock_everything();
  b.read(kRam, 1);
  EXPECT_EQ(b.run_us(1), End::refused);
}

}  // namespace
}  // namespace rotorloop::mcu::g431::testing
