// FDCAN1's registers, transmission, reception and filters, sentence by sentence of RM0440, section 44, against the virtual bus.
#include "test/unit/sim/mcu/g431/fdcan_bench.hpp"

namespace rotorloop::mcu::g431::testing {
namespace {

TEST(McuFdcan, Section44_4_AfterResetItIsInInitAndRegistersHaveTheirResetValues) {
  Bench b;
  b.clock_everything();
  EXPECT_EQ(b.read(CCCR), 1u);
  EXPECT_EQ(b.read(NBTP), 0x06000A03u);
  EXPECT_EQ(b.read(kCan + 4), 0x87654321u);
  EXPECT_EQ(b.read(PSR), 0x707u);
  EXPECT_EQ(b.read(TXFQS), 3u);
}

TEST(McuFdcan, Section44_3_1_ProtectedRegistersChangeInInitWithCceOnlyAndCceNeedsInit) {
  CanBench b;
  b.write(CCCR, 2);
  EXPECT_EQ(b.read(CCCR), 0u) << "CCE without INIT";
  b.write(NBTP, 0x06000A03);
  EXPECT_EQ(b.read(NBTP), kTiming);
  b.write(CCCR, 1);
  b.write(NBTP, 0x06000A03);
  EXPECT_EQ(b.read(NBTP), kTiming) << "INIT alone is not enough";
  b.write(CCCR, 3);
  b.write(NBTP, 0x06000A03);
  EXPECT_EQ(b.read(NBTP), 0x06000A03u);
  b.write(CCCR, 0);
  EXPECT_EQ(b.read(CCCR), 0u) << "INIT takes CCE with it";
}

TEST(McuFdcan, Section44_3_1_BitRateIsKernelClockOverPrescalerAndQuanta) {
  CanBench b;
  EXPECT_DOUBLE_EQ(b.chip.blocks().fdcan.bit_ns(), 1000.0);
  b.configure([&] { b.write(kCan + 0x100, 2); });  // CKDIV: by 4
  EXPECT_DOUBLE_EQ(b.chip.blocks().fdcan.bit_ns(), 4000.0);
}

TEST(McuFdcan, EveryFrameTakesItsStuffedBitsAndTxbtoAndTcSayThatItIsSent) {
  CanBench b;
  b.write(TXBTIE, 1);
  const CanFrame f = frame(0x123, {1, 2, 3, 4, 5, 6, 7, 8});
  b.send(0, f);
  EXPECT_EQ(b.read(TXBRP), 1u);
  b.run_us(frame_bits(f) - 1);
  EXPECT_EQ(b.read(TXBRP), 1u);
  b.run_us(2);
  EXPECT_EQ(b.read(TXBRP), 0u);
  EXPECT_EQ(b.read(TXBTO), 1u);
  EXPECT_EQ(b.read(IR) & 0x280, 0x280u) << "TC, TFE";
  ASSERT_EQ(b.on_bus.size(), 1u);
  EXPECT_EQ(b.on_bus[0].frame, f);
  EXPECT_EQ(b.on_bus[0].end_ns - b.on_bus[0].start_ns, 1000 * frame_bits(f));
  EXPECT_EQ(b.other->receive()->frame, f);
}

TEST(McuFdcan, Section44_3_6_TheFifoSendsInTheOrderOfRequestsAndCountsItsFreeElements) {
  CanBench b;
  EXPECT_EQ(b.read(TXFQS), 3u);
  b.send(0, frame(0x300));
  EXPECT_EQ(b.read(TXFQS), 1u << 16 | 2u) << "put index 1, two free";
  b.send(1, frame(0x100));
  b.send(2, frame(0x200));
  EXPECT_EQ(b.read(TXFQS), 1u << 21 | 0u) << "full";
  b.run_us(60);
  EXPECT_EQ(b.read(TXFQS) >> 8 & 3, 1u) << "get index";
  b.run_us(200);
  EXPECT_EQ(b.ids(), (std::vector<uint32_t>{0x300, 0x100, 0x200}));
}

TEST(McuFdcan, Section44_3_6_TheQueueSendsTheLowestIdentifierFirstAndOfEqualOnesTheLowestBuffer) {
  CanBench b;
  b.configure([&] { b.write(TXBC, 1u << 24); });
  b.put(0, frame(0x300, {0}));
  b.put(1, frame(0x100, {1}));
  b.put(2, frame(0x100, {2}));
  b.write(TXBAR, 7);
  EXPECT_EQ(b.read(TXFQS), 1u << 21) << "full; level and get index read 0";
  b.run_us(300);
  EXPECT_EQ(b.ids(), (std::vector<uint32_t>{0x100, 0x100, 0x300}));
  EXPECT_EQ(b.on_bus[0].frame.data[0], 1);
}

TEST(McuFdcan, ALateUrgentRequestOvertakesInTheQueueButNotTheFrameOnTheWire) {
  CanBench b;
  b.configure([&] { b.write(TXBC, 1u << 24); });
  b.send(0, frame(0x300));
  b.send(1, frame(0x400));
  b.run_us(10);
  b.send(2, frame(0x001));
  b.run_us(300);
  EXPECT_EQ(b.ids(), (std::vector<uint32_t>{0x300, 0x001, 0x400}));
}

TEST(McuFdcan, ItLosesArbitrationToALowerIdentifierOfAnotherNodeAndTriesAgain) {
  CanBench b;
  b.send(0, frame(0x200));
  b.bus.set_now(b.bus.now_ns());
  b.other->send(frame(0x050));
  b.run_us(300);
  EXPECT_EQ(b.ids(), (std::vector<uint32_t>{0x050, 0x200}));
  EXPECT_EQ(b.read(RXF0S) & 15, 1u) << "and has received what it lost to";
}

TEST(McuFdcan, Section44_3_6_DarDoesNotTryAgainAfterLostArbitration) {
  CanBench b;
  b.configure([] {}, 1u << 6);
  b.send(0, frame(0x200));
  b.bus.set_now(b.bus.now_ns());
  b.other->send(frame(0x050));
  b.run_us(300);
  EXPECT_EQ(b.ids(), (std::vector<uint32_t>{0x050}));
  EXPECT_EQ(b.read(TXBCF), 1u);
  EXPECT_EQ(b.read(TXBTO), 0u);
}

TEST(McuFdcan, Section44_3_6_ACancelledRequestIsNotSentAndOneOnTheWireIsSentInSpite) {
  CanBench b;
  b.send(0, frame(0x100, {}), 1u << 23 | 0x5Au << 24);
  b.send(1, frame(0x101));
  b.run_us(10);
  b.write(TXBCR, 3);
  EXPECT_EQ(b.read(TXBCF), 2u);
  EXPECT_EQ(b.read(TXBRP), 1u);
  b.run_us(300);
  EXPECT_EQ(b.ids(), (std::vector<uint32_t>{0x100}));
  EXPECT_EQ(b.read(TXBTO), 1u);
  EXPECT_EQ(b.read(TXBCF), 3u);
  EXPECT_EQ(b.read(kEvents + 4) >> 22, 0x5Au << 2 | 2u) << "marker, and type: in spite of cancellation";
}

TEST(McuFdcan, Section44_3_6_TransmitEventsCarryMarkerAndTimeStampAndTheFourthIsLost) {
  CanBench b;
  b.configure([&] { b.write(TSCC, 1); });
  for (uint32_t n = 0; n < 4; ++n) {
    b.send(n % 3, frame(0x100 + n), 1u << 23 | n << 24);
    b.run_us(100);
  }
  EXPECT_EQ(b.read(TXEFS), 1u << 25 | 1u << 24 | 3u) << "TEFL, full, three";
  EXPECT_EQ(b.read(kEvents + 8) >> 18 & 0x7FF, 0x101u);
  EXPECT_EQ(b.read(kEvents + 12) >> 24, 1u);
  EXPECT_NEAR(b.read(kEvents + 12) - b.read(kEvents + 4), 0x1000064, 2) << "100 bit times between two starts";
  b.write(TXEFA, 1);
  EXPECT_EQ(b.read(TXEFS) & 0xFF0F, 0x201u) << "index 1 frees 0 and 1";
}

TEST(McuFdcan, Section44_3_5_ReceivedElementsHaveIdentifierLengthDataFilterAndTimeStamp) {
  CanBench b;
  b.configure([&] { b.write(TSCC, 1); });
  b.hear(frame(0x1ABCDEF0, {0x11, 0x22, 0x33, 0x44, 0x55}, true));
  EXPECT_EQ(b.read(RXF0S), 1u << 16 | 1u);
  EXPECT_EQ(b.read(kRx0), 1u << 30 | 0x1ABCDEF0u);
  EXPECT_EQ(b.read(kRx0 + 4) & 0xFFFF0000, 1u << 31 | 5u << 16) << "ANMF: no filter named it";
  EXPECT_EQ(b.read(kRx0 + 8), 0x44332211u);
  EXPECT_EQ(b.read(kRx0 + 12) & 0xFF, 0x55u);
  const uint32_t stamp = b.read(kRx0 + 4) & 0xFFFF;
  EXPECT_NEAR(b.read(TSCV) - stamp, 200, 3) << "taken at the start of the frame";
}

TEST(McuFdcan, Section44_3_5_AFullFifoLosesTheFourthAndInOverwriteModeTheOldest) {
  CanBench b;
  for (uint32_t n = 0; n < 4; ++n) b.hear(frame(0x100 + n));
  EXPECT_EQ(b.read(RXF0S), 1u << 25 | 1u << 24 | 3u) << "lost, full, three";
  EXPECT_EQ(b.read(IR) & 7, 7u);
  EXPECT_EQ(b.read(kRx0) >> 18, 0x100u);
  b.write(IR, 4);
  EXPECT_EQ(b.read(RXF0S) >> 25, 0u) << "RF0L of the status is a copy of the flag";
  b.write(RXF0A, 0);
  EXPECT_EQ(b.read(RXF0S), 0u << 16 | 1u << 8 | 2u);
  b.configure([&] { b.write(RXGFC, 1u << 9); });
  for (uint32_t n = 0; n < 4; ++n) b.hear(frame(0x200 + n));
  EXPECT_EQ(b.read(RXF0S), 1u << 24 | 1u << 16 | 1u << 8 | 3u);
  EXPECT_EQ(b.read(kRx0) >> 18, 0x203u);
  EXPECT_EQ(b.read(IR) & 4, 0u) << "overwriting does not set RF0L";
}

TEST(McuFdcan, Section44_3_4_StandardFiltersAreRangePairAndMaskAndTheFirstThatFitsDecides) {
  CanBench b;
  b.configure([&] {
    b.write(kRam + 0, 0u << 30 | 1u << 27 | 0x100u << 16 | 0x10F);  // range: FIFO 0
    b.write(kRam + 4, 1u << 30 | 2u << 27 | 0x200u << 16 | 0x300);  // either: FIFO 1
    b.write(kRam + 8, 2u << 30 | 3u << 27 | 0x400u << 16 | 0x700);  // mask: rejected
    b.write(kRam + 12, 0u << 30 | 2u << 27 | 0x000u << 16 | 0x7FF);
    b.write(RXGFC, 4u << 16);
  });
  for (const uint32_t id : {0x105u, 0x300u, 0x4FFu, 0x110u}) b.hear(frame(id));
  EXPECT_EQ(b.read(RXF0S) & 15, 1u);
  EXPECT_EQ(b.read(RXF1S) & 15, 2u);
  EXPECT_EQ(b.read(kRx1 + 72) >> 18, 0x110u);
  EXPECT_EQ(b.read(kRx1 + 76) >> 24, 3u) << "index of the filter";
}

TEST(McuFdcan, Section44_3_4_ExtendedFiltersSeeTheIdentifierThroughXidamButForType3) {
  CanBench b;
  b.configure([&] {
    b.write(kRam + 0x70, 1u << 29 | 0x00001234);
    b.write(kRam + 0x74, 1u << 30 | 0x00001234);
    b.write(kRam + 0x78, 2u << 29 | 0x1F000000);
    b.write(kRam + 0x7C, 3u << 30 | 0x1FFFFFFF);
    b.write(XIDAM, 0xFFFF);
    b.write(RXGFC, 2u << 24 | 2u << 2);
  });
  for (const uint32_t id : {0x0AAA1234u, 0x1F001235u, 0x0AAA1235u}) b.hear(frame(id, {}, true));
  EXPECT_EQ(b.read(RXF0S) & 15, 1u);
  EXPECT_EQ(b.read(RXF1S) & 15, 1u);
}

TEST(McuFdcan, Section44_3_4_WhatNoFilterNamesGoesWhereTheGlobalFilterSays) {
  CanBench b;
  b.configure([&] { b.write(RXGFC, 1u << 4 | 2u << 2); });
  b.hear(frame(0x10));
  b.hear(frame(0x10, {}, true));
  EXPECT_EQ(b.read(RXF0S) & 15, 0u);
  EXPECT_EQ(b.read(RXF1S) & 15, 1u);
}

TEST(McuFdcan, Section44_3_4_APriorityFilterShowsItsMatchAndRaisesHpm) {
  CanBench b;
  b.configure([&] {
    b.write(kRam, 1u << 30 | 5u << 27 | 0x040u << 16 | 0x040);
    b.write(RXGFC, 1u << 16);
  });
  b.hear(frame(0x10));
  b.hear(frame(0x40));
  EXPECT_EQ(b.read(IR) >> 6 & 1, 1u);
  EXPECT_EQ(b.read(HPMS), 2u << 6 | 1u) << "standard list, filter 0, in FIFO 0, element 1";
}

TEST(McuFdcan, Section44_4_InterruptGroupsGoToOneOfTwoLines) {
  CanBench b;
  b.write(IE, 1);
  b.write(ILE, 3);
  b.hear(frame(0x10));
  EXPECT_TRUE(b.line(21));
  b.write(ILS, 1);
  EXPECT_FALSE(b.line(21));
  EXPECT_TRUE(b.line(22));
  b.write(IR, 1);
  EXPECT_FALSE(b.line(22)) << "a flag is cleared by writing 1";
}

}  // namespace
}  // namespace rotorloop::mcu::g431::testing
