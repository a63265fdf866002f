// Faults: each test shows the damage with the fault and its absence without, or the rule of ISO 11898-1 that bounds it.
#include <gtest/gtest.h>

#include "host/bus/frame_bits.hpp"
#include "sim/world/virtual_bus.hpp"
#include "test/unit/sim/world/bus_fixture.hpp"

namespace rotorloop::sim {
namespace {

using test::Bus;
using test::kBit_ns;
using test::standard;

// Sends an empty frame of `id` from port 0 every millisecond for `ms` milliseconds.
void send_each_ms(Bus& b, int ms, std::uint32_t id = 0x100) {
  const std::int64_t begin_ms = b.bus.now_ns() / kNs_per_ms;
  for (std::int64_t t = begin_ms; t < begin_ms + ms; ++t) {
    b.bus.advance_to(t * kNs_per_ms);
    b.port[0]->send(standard(id));
  }
  b.bus.advance_to((begin_ms + ms) * kNs_per_ms);
}

TEST(BusFault, NamesOfKindsAreReadBack) {
  for (const auto kind : {BusFaultKind::lose_sent, BusFaultKind::lose_received, BusFaultKind::corrupt, BusFaultKind::silent,
                          BusFaultKind::unplugged, BusFaultKind::extra_traffic}) {
    EXPECT_EQ(bus_fault_kind(name(kind)), kind);
  }
  EXPECT_FALSE(bus_fault_kind("gremlin").has_value());
}

TEST(BusFault, OneCorruptedFrameCostsAnErrorFrameAndIsSentAgain) {
  // Error seen at bit 10: 11 bits, 12 flag bits, 8 delimiter bits, 3 intermission bits, then the frame again.
  Bus b({.faults = {{.kind = BusFaultKind::corrupt, .port = 0, .max_count = 1, .error_bit = 10}}});
  b.port[0]->send(standard(0));
  b.bus.advance_to(1'000'000);
  ASSERT_EQ(b.trace.size(), 2u);
  EXPECT_TRUE(b.trace[0].error);
  EXPECT_EQ(b.trace[0].end_ns, 31 * kBit_ns);
  EXPECT_FALSE(b.trace[1].error);
  EXPECT_EQ(b.trace[1].start_ns, 34 * kBit_ns);
  EXPECT_EQ(b.received(1).size(), 1u);
  EXPECT_EQ(b.port[0]->counters().error_frames, 1u);
  EXPECT_EQ(b.bus.error_counters(0).transmit, 8 - 1);
  EXPECT_EQ(b.bus.error_counters(1).receive, 1 - 1);
  EXPECT_EQ(b.bus.statistics().busy_ns, (34 + 53) * kBit_ns);
}

TEST(BusFault, SixteenErrorsMakePassiveAndThirtyTwoBusOff) {
  Bus b({.recover_from_bus_off = false, .faults = {{.kind = BusFaultKind::corrupt, .port = 0}}});
  b.port[0]->send(standard(0x100));
  while (b.trace.size() < 16) b.bus.advance_to(b.bus.next_event_ns());
  EXPECT_EQ(b.port[0]->state(), BusState::error_passive);
  EXPECT_EQ(b.bus.error_counters(0).transmit, 128);
  while (b.port[0]->state() != BusState::bus_off && b.trace.size() < 100) b.bus.advance_to(b.bus.next_event_ns());
  EXPECT_EQ(b.trace.size(), 32u);
  EXPECT_EQ(b.port[0]->counters().error_frames, 32u);
  EXPECT_EQ(b.port[0]->counters().dropped_tx, 1u) << "the frame is given up";
  EXPECT_EQ(b.port[0]->send(standard(0x100)), SendStatus::bus_off);
  EXPECT_EQ(b.port[0]->counters().dropped_tx, 2u);
  EXPECT_EQ(b.trace[15].start_ns - b.trace[14].end_ns, 3 * kBit_ns) << "active: only the intermission between attempts";
  EXPECT_EQ(b.trace[16].start_ns - b.trace[15].end_ns, (3 + 8) * kBit_ns) << "passive: suspended for 8 bits more";
  b.bus.advance_to(kNs_per_s);
  EXPECT_EQ(b.port[0]->state(), BusState::bus_off);
}

TEST(BusFault, BusOffNodeReturnsAfter128Times11BitsOfAnIdleBus) {
  Bus b({.faults = {{.kind = BusFaultKind::corrupt, .port = 0, .max_count = 32}}});
  b.port[0]->send(standard(0x100));
  while (b.trace.size() < 32) b.bus.advance_to(b.bus.next_event_ns());
  const std::int64_t back_ns = b.trace.back().end_ns + (3 + 128 * 11) * kBit_ns;
  EXPECT_EQ(b.bus.next_event_ns(), back_ns);
  b.bus.advance_to(back_ns - 1);
  EXPECT_EQ(b.port[0]->state(), BusState::bus_off);
  b.bus.advance_to(back_ns);
  EXPECT_EQ(b.port[0]->state(), BusState::error_active);
  EXPECT_EQ(b.port[0]->send(standard(0x100)), SendStatus::queued);
  b.bus.advance_to(back_ns + 1'000'000);
  EXPECT_EQ(b.received(1).size(), 1u);
}

TEST(BusFault, BusOffNodeOnASaturatedBusReturnsAfter128FramesOfTheOthers) {
  Bus b({.faults = {{.kind = BusFaultKind::corrupt, .port = 0, .max_count = 32},
                    {.kind = BusFaultKind::extra_traffic, .frame = standard(0x7FF, {0, 0, 0, 0, 0, 0, 0, 0})}}});
  b.port[0]->send(standard(0x100));
  while (b.port[0]->state() != BusState::bus_off) b.bus.advance_to(b.bus.next_event_ns());
  const std::size_t off_at = b.trace.size();
  while (b.port[0]->state() == BusState::bus_off) b.bus.advance_to(b.bus.next_event_ns());
  EXPECT_NEAR(static_cast<double>(b.trace.size() - off_at), 128.0, 1.0);
}

TEST(BusFault, EveryElevenIdleBitsAndEveryFrameOfOthersBringABusOffNodeNearerToItsReturn) {
  Bus b({.faults = {{.kind = BusFaultKind::corrupt, .port = 0, .max_count = 32}}});
  b.port[0]->send(standard(0x100));
  while (b.trace.size() < 32) b.bus.advance_to(b.bus.next_event_ns());
  const std::int64_t idle_ns = b.trace.back().end_ns + 3 * kBit_ns;
  b.bus.advance_to(idle_ns + (100 * 11 + 5) * kBit_ns);  // 100 sequences and a broken one
  b.port[1]->send(standard(0));                          // 50 bits, then the 101st
  b.bus.advance_to(idle_ns + (100 * 11 + 5 + 50) * kBit_ns);
  EXPECT_FALSE(b.port[0]->receive().has_value()) << "a node that is off hears nothing";
  EXPECT_TRUE(b.port[2]->receive().has_value());
  EXPECT_EQ(b.bus.statistics().missed_while_off, 1u);
  const std::int64_t back_ns = idle_ns + (100 * 11 + 5 + 53 + 27 * 11) * kBit_ns;
  b.bus.advance_to(back_ns - 1);
  EXPECT_EQ(b.port[0]->state(), BusState::bus_off);
  b.bus.advance_to(back_ns);
  EXPECT_EQ(b.port[0]->state(), BusState::error_active);
}

TEST(BusFault, ListenerOf128ErrorsIsPassiveUntilOneGoodFrameSetsItTo119) {
  // Five senders in turn, each destroyed 31 times (just not bus-off) before its frame gets through: +30 for the listener each.
  BusConfig config;
  for (int i = 0; i < 5; ++i) config.faults.push_back({.kind = BusFaultKind::corrupt, .port = i, .max_count = 31});
  Bus b(config, 6);
  for (std::uint32_t i = 0; i < 5; ++i) b.port[i]->send(standard(0x100 + i));
  while (b.bus.error_counters(5).receive < 127) b.bus.advance_to(b.bus.next_event_ns());
  EXPECT_EQ(b.port[5]->state(), BusState::error_active);
  while (b.bus.error_counters(5).receive < 128) b.bus.advance_to(b.bus.next_event_ns());
  EXPECT_EQ(b.port[5]->state(), BusState::error_passive);
  while (b.trace.back().error) b.bus.advance_to(b.bus.next_event_ns());
  EXPECT_EQ(b.bus.error_counters(5).receive, 119);
  EXPECT_EQ(b.port[5]->state(), BusState::error_active);
}

TEST(BusFault, LoneNodeGetsNoAcknowledgeAndStaysErrorPassiveInsteadOfBusOff) {
  Bus b({}, 1);
  b.port[0]->send(standard(0x100));
  b.bus.advance_to(100'000'000);
  EXPECT_EQ(b.port[0]->state(), BusState::error_passive);
  EXPECT_EQ(b.bus.error_counters(0).transmit, 128);
  EXPECT_EQ(b.port[0]->counters().sent, 0u);
  EXPECT_GT(b.port[0]->counters().error_frames, 1000u) << "it tries again without end";
}

TEST(BusFault, GoodFramesBringAPassiveNodeBack) {
  Bus b({.faults = {{.kind = BusFaultKind::corrupt, .port = 0, .max_count = 16}}});
  b.port[0]->send(standard(0x100));
  b.bus.advance_to(5'000'000);
  EXPECT_EQ(b.bus.error_counters(0).transmit, 16 * 8 - 1);
  EXPECT_EQ(b.port[0]->state(), BusState::error_active) << "127 is the last active value";
  EXPECT_EQ(b.port[1]->state(), BusState::error_active) << "receivers count by one";
}

TEST(BusFault, SilentNodeIsNotHeardFromItsTimeOnAndIsHeardAgainAfterIt) {
  Bus healthy, b({.faults = {{.kind = BusFaultKind::silent, .port = 0, .at_ns = 10 * kNs_per_ms, .duration_ns = 10 * kNs_per_ms}}});
  send_each_ms(healthy, 30);
  send_each_ms(b, 30);
  EXPECT_EQ(healthy.received(1).size(), 30u);
  const auto got = b.received(1);
  EXPECT_EQ(got.size(), 20u);
  for (const StampedFrame& f : got) EXPECT_FALSE(f.time_ns >= 10 * kNs_per_ms && f.time_ns < 20 * kNs_per_ms);
  EXPECT_EQ(b.port[0]->counters().dropped_tx, 10u);
}

TEST(BusFault, SilentNodeStillAcknowledges) {
  Bus b({.faults = {{.kind = BusFaultKind::silent, .port = 1}}}, 2);
  b.port[0]->send(standard(1));
  b.bus.advance_to(1'000'000);
  EXPECT_EQ(b.port[0]->counters().sent, 1u);
  EXPECT_EQ(b.received(1).size(), 1u);
}

TEST(BusFault, UnpluggedNodeNeitherHearsNorAcknowledges) {
  Bus b({.faults = {{.kind = BusFaultKind::unplugged, .port = 1}}}, 2);
  b.port[0]->send(standard(1));
  b.port[1]->send(standard(2));
  b.bus.advance_to(1'000'000);
  EXPECT_EQ(b.port[0]->counters().sent, 0u) << "nobody is left to acknowledge";
  EXPECT_GT(b.port[0]->counters().error_frames, 0u);
  EXPECT_TRUE(b.received(0).empty());
  EXPECT_TRUE(b.received(1).empty());
}

TEST(BusFault, LostReceptionHitsOneNodeAndOneIdOnly) {
  Bus b({.faults = {{.kind = BusFaultKind::lose_received, .port = 1, .id = 0x100, .id_mask = 0x7FF}}});
  b.port[0]->send(standard(0x100));
  b.port[0]->send(standard(0x101));
  b.bus.advance_to(1'000'000);
  const auto got = b.received(1);
  ASSERT_EQ(got.size(), 1u);
  EXPECT_EQ(got[0].frame.id, 0x101u);
  EXPECT_EQ(b.received(2).size(), 2u);
  EXPECT_EQ(b.bus.statistics().lost_by_fault, 1u);
}

TEST(BusFault, LostSendingIsSentWellAndHeardByNobody) {
  Bus b({.faults = {{.kind = BusFaultKind::lose_sent, .port = 0, .max_count = 1}}});
  b.port[0]->send(standard(0x100));
  b.port[0]->send(standard(0x101));
  b.bus.advance_to(1'000'000);
  EXPECT_EQ(b.port[0]->counters().sent, 2u);
  EXPECT_EQ(b.received(1).size(), 1u);
  EXPECT_EQ(b.received(2).size(), 1u);
}

TEST(BusFault, LossOf10PercentLoses10PercentOf20000FramesAndTheSameOnesEachTime) {
  const auto run = [](std::uint64_t seed) {
    Bus b({.seed = seed, .faults = {{.kind = BusFaultKind::lose_received, .port = 1, .probability = 0.1}}});
    std::vector<std::int64_t> got;
    for (int block = 0; block < 200; ++block) {
      send_each_ms(b, 100);
      for (const StampedFrame& f : b.received(1)) got.push_back(f.time_ns);
      b.received(2);
    }
    return got;
  };
  const auto first = run(1);
  EXPECT_NEAR(static_cast<double>(first.size()), 18'000.0, 5 * 42.4);  // binomial, five standard deviations
  EXPECT_EQ(first, run(1));
  EXPECT_NE(first, run(2));
}

TEST(BusFault, BabblingNodeOfLowestIdStarvesTheBusAndOneOfHighestIdOnlyDelaysByOneFrame) {
  const auto run = [](std::uint32_t babble_id) {
    Bus b({.faults = {{.kind = BusFaultKind::extra_traffic, .frame = standard(babble_id, {0, 0, 0, 0, 0, 0, 0, 0})}}});
    send_each_ms(b, 50);
    return std::pair(b.port[0]->counters().sent, b.bus.statistics());
  };
  const auto [starved, full] = run(0x000);
  EXPECT_EQ(starved, 0u);
  EXPECT_NEAR(full.mean_load_percent, 100.0, 0.01);
  const auto [through, filled] = run(0x7FF);
  EXPECT_EQ(through, 50u);
  EXPECT_NEAR(filled.mean_load_percent, 100.0, 0.01);
  EXPECT_LE(filled.ids.at(0).worst_wait_ns, worst_frame_bits(false, 8) * kBit_ns);
}

TEST(BusFault, ExtraTrafficOfAPeriodAddsItsLoadAndEndsWithTheFault) {
  // 53 bits every 100 us for 20 ms: 53 % in two windows of 10 ms, then nothing.
  Bus b({.faults = {{.kind = BusFaultKind::extra_traffic, .duration_ns = 20 * kNs_per_ms, .frame = standard(0), .period_ns = 100'000}}});
  b.bus.advance_to(30 * kNs_per_ms);
  const auto windows = b.bus.load_by_window_percent();
  ASSERT_EQ(windows.size(), 3u);
  EXPECT_FLOAT_EQ(windows[0], 53.0f);
  EXPECT_FLOAT_EQ(windows[1], 53.0f);
  EXPECT_FLOAT_EQ(windows[2], 0.0f);
  EXPECT_EQ(b.received(0).size(), 200u);
}

TEST(BusFault, IdealBusStillLosesAndFallsSilent) {
  Bus b(
      {.ideal = true,
       .faults = {{.kind = BusFaultKind::silent, .port = 0, .at_ns = 10 * kNs_per_ms}, {.kind = BusFaultKind::lose_received, .port = 2}}});
  send_each_ms(b, 20);
  EXPECT_EQ(b.received(1).size(), 10u);
  EXPECT_TRUE(b.received(2).empty());
}

}  // namespace
}  // namespace rotorloop::sim
