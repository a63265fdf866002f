// FDCAN1, sentence by sentence of RM0440, section 44, against the virtual bus.
#include "host/bus/frame_bits.hpp"
#include "sim/mcu/g431/fdcan/virtual_bus_medium.hpp"
#include "test/unit/sim/mcu/g431/bench.hpp"

namespace rotorloop::mcu::g431::testing {
namespace {

constexpr uint32_t kCan = 0x40006400, kRam = 0x4000A400, kTx = kRam + 0x278, kRx0 = kRam + 0x0B0, kRx1 = kRam + 0x188,
                   kEvents = kRam + 0x260;
constexpr uint32_t TEST = kCan + 0x10, CCCR = kCan + 0x18, NBTP = kCan + 0x1C, TSCC = kCan + 0x20, TSCV = kCan + 0x24, ECR = kCan + 0x40,
                   PSR = kCan + 0x44, IR = kCan + 0x50, IE = kCan + 0x54, ILS = kCan + 0x58, ILE = kCan + 0x5C, RXGFC = kCan + 0x80,
                   XIDAM = kCan + 0x84, HPMS = kCan + 0x88, RXF0S = kCan + 0x90, RXF0A = kCan + 0x94, RXF1S = kCan + 0x98,
                   TXBC = kCan + 0xC0, TXFQS = kCan + 0xC4, TXBRP = kCan + 0xC8, TXBAR = kCan + 0xCC, TXBCR = kCan + 0xD0,
                   TXBTO = kCan + 0xD4, TXBCF = kCan + 0xD8, TXBTIE = kCan + 0xDC, TXEFS = kCan + 0xE4, TXEFA = kCan + 0xE8;
constexpr uint32_t kTiming = 9u << 16 | 13u << 8 | 1u;  // by 10, 1 + 14 + 2 quanta: 1 Mbit/s at 170 MHz

CanFrame frame(uint32_t id, std::initializer_list<uint8_t> bytes = {}, bool extended = false) {
  CanFrame f{.id = id, .extended = extended, .length = static_cast<uint8_t>(bytes.size()), .data = {}};
  std::copy(bytes.begin(), bytes.end(), f.data.begin());
  return f;
}

std::vector<sim::BusFault> alone() {
  return {{.kind = sim::BusFaultKind::unplugged, .port = 1, .at_ns = 0}, {.kind = sim::BusFaultKind::unplugged, .port = 2, .at_ns = 0}};
}

class CanBench : public Bench {
 public:
  explicit CanBench(std::vector<sim::BusFault> faults = {}) : bus({.faults = std::move(faults)}), medium(bus, chip.blocks().fdcan, true) {
    other = &bus.attach({.name = "other"});
    bus.attach({.name = "a third, which acknowledges"});
    bus.set_tap([this](const sim::BusEvent& e) { on_bus.push_back(e); });
    run_at_170_MHz();
    write(kRcc + 0x88, 2u << 24);  // kernel clock: PCLK1
    configure([] {});
  }
  // In INIT and CCE, then on the bus.
  template <class Registers>
  void configure(Registers&& registers, uint32_t modes = 0, uint32_t timing = kTiming) {
    write(CCCR, 1);
    write(CCCR, 3);
    write(NBTP, timing);
    write(CCCR, 3 | modes);
    registers();
    write(CCCR, modes);
    run_us(20);
  }
  void put(uint32_t buffer, const CanFrame& f, uint32_t second = 0) {
    const uint32_t at = kTx + 72 * buffer;
    write(at, f.extended ? 1u << 30 | f.id : f.id << 18);
    write(at + 4, uint32_t{f.length} << 16 | second);
    for (uint32_t i = 0; i < f.length; i += 4)
      write(at + 8 + i, f.data[i] | uint32_t{f.data[i + 1]} << 8 | uint32_t{f.data[i + 2]} << 16 | uint32_t{f.data[i + 3]} << 24);
  }
  void send(uint32_t buffer, const CanFrame& f, uint32_t second = 0) {
    put(buffer, f, second);
    write(TXBAR, 1u << buffer);
  }
  int64_t now_ns() { return std::llround(chip.time_s() * 1e9); }
  void hear(const CanFrame& f) {
    bus.set_now(std::max(bus.now_ns(), now_ns()));
    other->send(f);
    bus.has_frame(bus.now_ns());
    read(CCCR);
    run_us(200);
  }
  std::vector<uint32_t> ids() const {
    std::vector<uint32_t> out;
    for (const auto& e : on_bus)
      if (!e.error) out.push_back(e.frame.id);
    return out;
  }

  sim::VirtualBus bus;
  VirtualBusMedium medium;
  CanBus* other = nullptr;
  std::vector<sim::BusEvent> on_bus;
};

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
