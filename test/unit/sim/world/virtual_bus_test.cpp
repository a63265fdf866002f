// Promises of the virtual bus that a node programmer relies on: who wins, when a frame arrives, what is counted.
#include "sim/world/virtual_bus.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "host/base/error.hpp"
#include "host/bus/frame_bits.hpp"
#include "test/unit/sim/world/bus_fixture.hpp"

namespace rotorloop::sim {
namespace {

using test::Bus;
using test::extended;
using test::kBit_ns;
using test::standard;
using ::testing::HasSubstr;

TEST(VirtualBusTiming, EmptyFrameOfIdZeroTakes50BitsAndTheNextOneStarts3BitsLater) {
  // 34 dominant bits, 6 stuff bits, 10 bits of tail (counted by hand in frame_bits_test.cpp); 1 us per bit.
  Bus b;
  b.bus.advance_to(1'000'000);
  b.port[0]->send(standard(0));
  b.port[0]->send(standard(0));
  b.bus.advance_to(2'000'000);
  ASSERT_EQ(b.trace.size(), 2u);
  EXPECT_EQ(b.trace[0].start_ns, 1'000'000);
  EXPECT_EQ(b.trace[0].end_ns, 1'050'000);
  EXPECT_EQ(b.trace[1].start_ns, 1'053'000);
  EXPECT_EQ(b.trace[1].end_ns, 1'103'000);
}

TEST(VirtualBusTiming, ZeroDataTakeLongerThanAlternatingDataByTheirStuffBits) {
  // Eight zero bytes: 13 stuff bits in the data; eight 0x55 behind a DLC of 1000: none. Header of id 0x555: none before the DLC.
  const CanFrame zeros = standard(0x555, {0, 0, 0, 0, 0, 0, 0, 0});
  const CanFrame alternating = standard(0x555, {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55});
  Bus b;
  b.port[0]->send(zeros);
  b.bus.advance_to(1'000'000);
  b.port[0]->send(alternating);
  b.bus.advance_to(2'000'000);
  const std::int64_t zeros_ns = b.trace[0].end_ns - b.trace[0].start_ns;
  const std::int64_t alternating_ns = b.trace[1].end_ns - b.trace[1].start_ns;
  EXPECT_GE(zeros_ns, (44 + 64 + 13) * kBit_ns);
  EXPECT_LE(alternating_ns, (44 + 64 + 3) * kBit_ns);  // at most 3 in 15 CRC bits
  EXPECT_EQ(zeros_ns, frame_bits(zeros) * kBit_ns);
  EXPECT_EQ(alternating_ns, frame_bits(alternating) * kBit_ns);
}

TEST(VirtualBusTiming, HalfTheBitRateDoublesTheFrameTime) {
  Bus b({.bit_rate_Hz = 500'000});
  b.port[0]->send(standard(0));
  b.bus.advance_to(1'000'000);
  EXPECT_EQ(b.trace.at(0).end_ns, 100'000);
}

TEST(VirtualBusArbitration, LowerIdWinsWhateverTheOrderOfSending) {
  for (const bool low_first : {true, false}) {
    Bus b;
    b.bus.advance_to(1000);
    b.port[0]->send(standard(low_first ? 0x100 : 0x200));
    b.port[1]->send(standard(low_first ? 0x200 : 0x100));
    b.bus.advance_to(1'000'000);
    const auto got = b.received(2);
    ASSERT_EQ(got.size(), 2u);
    EXPECT_EQ(got[0].frame.id, 0x100u);
    EXPECT_EQ(got[1].frame.id, 0x200u);
  }
}

TEST(VirtualBusArbitration, StandardFrameBeatsExtendedFrameWithTheSameLeading11Bits) {
  Bus b;
  b.port[0]->send(extended(0x100u << 18));
  b.port[1]->send(standard(0x100));
  b.bus.advance_to(1'000'000);
  EXPECT_FALSE(b.trace.at(0).frame.extended);
  EXPECT_TRUE(b.trace.at(1).frame.extended);
}

TEST(VirtualBusArbitration, FrameQueuedDuringAnotherWaitsForItsEndHoweverImportant) {
  Bus b;
  b.port[0]->send(standard(0x7FF, {1, 2, 3, 4, 5, 6, 7, 8}));
  b.bus.advance_to(1'001);  // the arbitration at 0 is over
  b.port[1]->send(standard(0x000));
  b.bus.advance_to(1'000'000);
  EXPECT_EQ(b.trace.at(0).frame.id, 0x7FFu);
  EXPECT_EQ(b.trace.at(1).start_ns, b.trace.at(0).end_ns + 3 * kBit_ns);
}

TEST(VirtualBusArbitration, FrameSentAtTheInstantOfAnArbitrationStillTakesPart) {
  Bus b;
  b.port[0]->send(standard(0x200));
  b.bus.advance_to(0);  // the arbitration at 0 stays open
  b.port[1]->send(standard(0x100));
  b.bus.advance_to(1'000'000);
  EXPECT_EQ(b.trace.at(0).frame.id, 0x100u);
}

TEST(VirtualBusArbitration, FramesOfTheSameIdLeaveInTheOrderTheyWereSent) {
  // A multi-frame transfer of 30 frames, with a more important frame pushed in after every fifth.
  Bus b;
  for (int i = 0; i < 30; ++i) {
    b.port[0]->send(extended(0x18000101, {i}));
    if (i % 5 == 0) b.port[0]->send(extended(0x00000101, {100 + i}));
  }
  b.bus.advance_to(10'000'000);
  int next = 0;
  for (const StampedFrame& f : b.received(1)) {
    if (f.frame.id != 0x18000101) continue;
    EXPECT_EQ(f.frame.data[0], next++);
  }
  EXPECT_EQ(next, 30);
}

TEST(VirtualBusArbitration, TwoNodesWithTheSameIdAndDifferentDataDestroyEachOther) {
  // The same id at the same instant is a fault of configuration (two nodes with one node id); on a wire it ends in bus-off.
  Bus b;
  b.port[0]->send(standard(0x100, {1}));
  b.port[1]->send(standard(0x100, {2}));
  b.bus.advance_to(100'000'000);
  EXPECT_TRUE(b.trace.at(0).error);
  EXPECT_GT(b.bus.statistics().id_collisions, 0u);
  EXPECT_GE(b.port[0]->counters().error_frames, 16u);
  EXPECT_TRUE(b.received(2).empty());
}

TEST(VirtualBusArbitration, TwoNodesWithTheSameFrameBothSucceedInOneTransmission) {
  Bus b;
  b.port[0]->send(standard(0x100, {1}));
  b.port[1]->send(standard(0x100, {1}));
  b.bus.advance_to(1'000'000);
  EXPECT_EQ(b.trace.size(), 1u);
  EXPECT_EQ(b.port[0]->counters().sent, 1u);
  EXPECT_EQ(b.port[1]->counters().sent, 1u);
  EXPECT_EQ(b.received(2).size(), 1u);
}

TEST(VirtualBusPorts, FrameReachesAllOthersAtTheEndOfFrameAndNeverItsSender) {
  Bus b;
  b.port[0]->send(standard(0));
  b.bus.advance_to(49'999);
  EXPECT_FALSE(b.port[1]->receive().has_value());
  b.bus.advance_to(50'000);
  EXPECT_EQ(b.port[1]->receive()->time_ns, 50'000);
  EXPECT_TRUE(b.port[2]->receive().has_value());
  EXPECT_FALSE(b.port[0]->receive().has_value());
}

TEST(VirtualBusPorts, LatencyDelaysArbitrationOnTheWayOutAndSightOnTheWayInButNotTheStamp) {
  VirtualBus bus({});
  CanBus& adapter = bus.attach({.name = "USB adapter", .tx_latency_ns = 1'000'000, .rx_latency_ns = 500'000});
  CanBus& node = bus.attach({.name = "node"});
  adapter.send(standard(0));
  bus.advance_to(1'049'999);
  EXPECT_FALSE(node.receive().has_value());
  bus.advance_to(1'050'000);
  EXPECT_EQ(node.receive()->time_ns, 1'050'000);

  bus.advance_to(2'000'000);
  node.send(standard(0));
  bus.advance_to(2'549'999);
  EXPECT_FALSE(adapter.receive().has_value());
  bus.advance_to(2'550'000);
  EXPECT_EQ(adapter.receive()->time_ns, 2'050'000);
}

TEST(VirtualBusPorts, FullQueuesDropCountAndSaySo) {
  VirtualBus bus({});
  CanBus& a = bus.attach({.name = "a", .tx_depth = 4});
  CanBus& b = bus.attach({.name = "b", .rx_depth = 2});
  for (int i = 0; i < 4; ++i) EXPECT_EQ(a.send(standard(1)), SendStatus::queued);
  EXPECT_EQ(a.send(standard(1)), SendStatus::queue_full);
  bus.advance_to(1'000'000);
  EXPECT_EQ(a.counters().dropped_tx, 1u);
  EXPECT_EQ(a.counters().sent, 4u);
  EXPECT_EQ(b.counters().received, 2u);
  EXPECT_EQ(b.counters().dropped_rx, 2u);
}

TEST(VirtualBusPorts, ImpossibleFrameIsRefusedAtOnce) {
  Bus b;
  EXPECT_THROW(b.port[0]->send(standard(0x800)), std::invalid_argument);
  CanFrame too_long = standard(1);
  too_long.length = 9;
  EXPECT_THROW(b.port[0]->send(too_long), std::invalid_argument);
}

TEST(VirtualBusTime, StepsOfAnyLengthGiveTheSameTrace) {
  const auto run = [](std::int64_t step_ns) {
    Bus b;
    for (std::int64_t t = 0; t <= 20'000'000; t += step_ns) {
      b.bus.advance_to(t);
      if (t % 1'000'000 == 0) {
        for (std::uint32_t i = 0; i < 3; ++i) b.port[i]->send(standard(0x300 - i, {static_cast<int>(t / 1'000'000)}));
      }
    }
    return std::move(b.trace);
  };
  const auto fine = run(500);
  const auto coarse = run(1'000'000);
  ASSERT_EQ(fine.size(), 60u);
  ASSERT_EQ(coarse.size(), 60u);
  for (std::size_t i = 0; i < 60; ++i) {
    EXPECT_EQ(fine[i].start_ns, coarse[i].start_ns);
    EXPECT_EQ(fine[i].frame, coarse[i].frame);
  }
}

TEST(VirtualBusTime, JumpingFromEventToEventMissesNothing) {
  Bus b;
  for (std::uint32_t i = 0; i < 10; ++i) b.port[i % 3]->send(standard(0x100 + i));
  int stops = 0;
  std::vector<std::int64_t> seen;
  for (std::int64_t t = b.bus.next_event_ns(); t != kNever_ns && stops < 100; t = b.bus.next_event_ns(), ++stops) {
    b.bus.advance_to(t);
    while (const auto f = b.port[0]->receive()) {
      EXPECT_EQ(f->time_ns, t) << "seen late";
      seen.push_back(f->time_ns);
    }
  }
  EXPECT_EQ(b.trace.size(), 10u);
  EXPECT_LE(stops, 20);
}

TEST(VirtualBusTime, SetNowStampsFramesAheadWithoutMovingTheBus) {
  Bus b;
  b.bus.set_now(300'000);
  b.port[0]->send(standard(0x200));
  b.bus.set_now(200'000);  // another node, simulated later, sends earlier
  b.port[1]->send(standard(0x300));
  EXPECT_TRUE(b.trace.empty());
  b.bus.advance_to(1'000'000);
  EXPECT_EQ(b.trace.at(0).start_ns, 200'000);
  EXPECT_EQ(b.trace.at(0).frame.id, 0x300u);
  EXPECT_EQ(b.trace.at(1).start_ns, 300'000);
}

TEST(VirtualBusTime, ThePastIsClosed) {
  Bus b;
  b.bus.advance_to(1'000);
  EXPECT_THROW(b.bus.advance_to(999), std::logic_error);
  EXPECT_THROW(b.bus.set_now(999), std::logic_error);
}

TEST(VirtualBusStatistics, LoadOfFramesCountedByHandIsExact) {
  // One empty frame of id 0 per millisecond: 50 bits + 3 bits of intermission = 5.3 % at 1 Mbit/s.
  Bus b;
  for (std::int64_t ms = 0; ms < 100; ++ms) {
    b.bus.advance_to(ms * kNs_per_ms);
    b.port[0]->send(standard(0));
  }
  b.bus.advance_to(100 * kNs_per_ms);
  const BusStatistics s = b.bus.statistics();
  EXPECT_DOUBLE_EQ(s.mean_load_percent, 5.3);
  EXPECT_DOUBLE_EQ(s.max_load_percent, 5.3);
  EXPECT_EQ(b.bus.load_by_window_percent().size(), 10u);
  ASSERT_EQ(s.ids.size(), 1u);
  EXPECT_EQ(s.ids[0].frames, 100u);
  EXPECT_EQ(s.ids[0].bus_bits, 5'300u);
  EXPECT_EQ(s.ids[0].worst_response_ns, 50'000);
}

TEST(VirtualBusStatistics, WaitIsFromSendToTheStartOfTheFrame) {
  Bus b;
  b.port[0]->send(standard(0));
  b.port[1]->send(standard(1));
  b.bus.advance_to(1'000'000);
  EXPECT_EQ(b.bus.statistics().worst_wait_ns, 53'000);
  EXPECT_EQ(b.bus.statistics().ids.at(0).worst_wait_ns, 0);
  EXPECT_EQ(b.bus.statistics().ids.at(1).worst_wait_ns, 53'000);
}

TEST(VirtualBusIdeal, DeliversAtOnceWithoutBusTimeOrArbitration) {
  Bus b({.ideal = true});
  b.bus.advance_to(7'000);
  b.port[0]->send(standard(0x200));
  b.port[1]->send(standard(0x100));
  const auto got = b.received(2);
  ASSERT_EQ(got.size(), 2u);
  EXPECT_EQ(got[0].frame.id, 0x200u) << "order of sending, not of identifiers";
  EXPECT_EQ(got[0].time_ns, 7'000);
  EXPECT_EQ(b.bus.next_event_ns(), kNever_ns);
  b.bus.advance_to(1'000'000);
  EXPECT_EQ(b.bus.statistics().busy_ns, 0);
  EXPECT_EQ(b.bus.statistics().frames, 2u);
}

TEST(VirtualBusConfig, MistakesAreRefusedWithTheirRemedy) {
  const auto refusal = [](const BusConfig& config) {
    try {
      Bus b(config);
      b.bus.advance_to(0);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(refusal({.bit_rate_Hz = 83'333}), HasSubstr("bit rate 83333 Hz does not give whole nanoseconds"));
  EXPECT_THAT(refusal({.bit_rate_Hz = 0}), HasSubstr("bit rate 0 Hz"));
  EXPECT_THAT(refusal({.load_window_ns = 0}), HasSubstr("load window of 0 ns"));
  EXPECT_THAT(refusal({.faults = {{.kind = BusFaultKind::silent, .port = 3}}}), HasSubstr("names port 3, the bus has 3 ports"));
  EXPECT_THAT(refusal({.faults = {{.kind = BusFaultKind::corrupt, .probability = 1.5}}}), HasSubstr("probability outside 0..1"));
  EXPECT_THAT(refusal({.ideal = true, .faults = {{.kind = BusFaultKind::corrupt}}}), HasSubstr("ideal bus does not have"));
  Bus late;
  late.bus.advance_to(0);
  EXPECT_THROW(late.bus.attach({.name = "late"}), Error);
}

}  // namespace
}  // namespace rotorloop::sim
