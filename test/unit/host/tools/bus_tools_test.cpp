// What stands behind `rotorloop bus`: naming frames, counting traffic, joining buses, playing recordings.
#include <gtest/gtest.h>

#include "host/bus/frame_bits.hpp"
#include "host/tools/bridge.hpp"
#include "host/tools/frame_text.hpp"
#include "host/tools/replay.hpp"
#include "host/tools/traffic_table.hpp"
#include "test/unit/host/tools/queue_bus.hpp"

namespace rotorloop::tools {
namespace {

constexpr std::uint32_t kRawCommandOf120 = 0x07040678, kNodeStatusOf42 = 0x1401552A, kEscStatusOf21 = 0x10040A15;

TEST(FrameKind, NamesTypeSenderAndReceiverFromTheIdentifier) {
  const FrameKind status = frame_kind(extended_frame(kNodeStatusOf42));
  EXPECT_EQ(status.type, "NodeStatus");
  EXPECT_EQ(addresses(status), "42 -> *");
  const FrameKind request = frame_kind(extended_frame(0x1E0B95FF));  // GetSet, 127 asks 21
  EXPECT_EQ(request.type, "param.GetSet");
  EXPECT_EQ(request.role, "request");
  EXPECT_EQ(addresses(request), "127 -> 21");
  EXPECT_EQ(frame_kind(extended_frame(0x1E0B7F95)).role, "response");
  EXPECT_EQ(frame_kind(extended_frame(0x1050A115)).type, "message 20641");
  EXPECT_EQ(addresses(frame_kind(extended_frame(0x1E000100))), "anonymous -> *");
}

TEST(FrameKind, CommandsAndArmingAreKnownForWhatMovesMotors) {
  EXPECT_TRUE(frame_kind(extended_frame(kRawCommandOf120)).moves_motors);
  EXPECT_TRUE(frame_kind(extended_frame(0x08044C78)).moves_motors);  // ArmingStatus
  EXPECT_FALSE(frame_kind(extended_frame(kNodeStatusOf42)).moves_motors);
  BusFrame fast = extended_frame(0x0A0);
  fast.extended = false;
  EXPECT_TRUE(frame_kind(fast).moves_motors);
  fast.id = 0x140;
  EXPECT_FALSE(frame_kind(fast).moves_motors);
}

TEST(TrafficTable, RowsStandInTheOrderOfArbitrationWithTheirGapsAndTheLoadIsThatOfTheBitsOnTheWire) {
  TrafficTable table;
  const CanFrame fast{.id = 0x140, .extended = false, .length = 4, .data = {}};
  for (std::int64_t ms = 0; ms <= 100; ++ms) {
    if (ms != 50) table.add({.frame = BusFrame(fast), .time_ns = ms * 1'000'000});
    if (ms % 50 == 0) table.add({.frame = extended_frame(kNodeStatusOf42), .time_ns = ms * 1'000'000});
  }
  const Traffic t = table.traffic();
  ASSERT_EQ(t.rows.size(), 2u);
  EXPECT_EQ(t.rows[0].newest.id, 0x140u);
  EXPECT_EQ(t.rows[0].frames, 100u);
  EXPECT_EQ(t.rows[0].longest_gap_ns, 2'000'000);
  EXPECT_EQ(t.rows[1].longest_gap_ns, 50'000'000);
  const int slow_bits = frame_bits(*extended_frame(kNodeStatusOf42).classic()) + kIntermissionBits;
  const double expected_percent = (100.0 * (frame_bits(fast) + kIntermissionBits) + 3.0 * slow_bits) / (1e6 * 0.1) * 100.0;
  EXPECT_NEAR(load_percent(t, 1e6), expected_percent, 1e-9);
}

TEST(Bridge, AFrameOfOneBusGoesToAllOthersAndToNoneTwice) {
  QueueBus a, b, c;
  a.waiting.push_back({.frame = extended_frame(1, 7), .time_ns = 0});
  b.waiting.push_back({.frame = extended_frame(2, 8), .time_ns = 0});
  Bridge bridge({&a, &b, &c});
  EXPECT_EQ(bridge.forward(), 2u);
  ASSERT_EQ(a.sent.size(), 1u);
  ASSERT_EQ(b.sent.size(), 1u);
  ASSERT_EQ(c.sent.size(), 2u);
  EXPECT_EQ(a.sent[0].frame, extended_frame(2, 8));
  EXPECT_EQ(b.sent[0].frame, extended_frame(1, 7));
  EXPECT_EQ(bridge.counters()[2].given, 2u);
}

TEST(Bridge, FramesThatABusDoesNotTakeAreCountedThere) {
  QueueBus a, full(0);
  for (int i = 0; i < 3; ++i) a.waiting.push_back({.frame = extended_frame(1), .time_ns = 0});
  Bridge bridge({&a, &full});
  bridge.forward();
  EXPECT_EQ(bridge.counters()[0].taken, 3u);
  EXPECT_EQ(bridge.counters()[1].refused, 3u);
}

BusLog flight_log() {
  BusLog log;
  log.interfaces = {"can0"};
  for (std::int64_t ms = 0; ms < 10; ++ms)
    for (const std::uint32_t id : {kRawCommandOf120, kEscStatusOf21})
      log.frames.push_back({.time_ns = 5'000'000'000 + ms * 1'000'000, .interface = 0, .frame = extended_frame(id)});
  return log;
}

ReplayCounters play(const ReplayOptions& options, QueueBus& bus) {
  const BusLog log = flight_log();
  Replay replay(log, options, bus.now_ns());
  while (const auto next_ns = replay.step(bus)) bus.wait_until(*next_ns);
  return replay.counters();
}

TEST(Replay, KeepsTheTimesOfTheRecordingAtAnyPace) {
  for (const double pace : {1.0, 4.0}) {
    QueueBus bus;
    bus.now = 77;
    play({.pace = pace}, bus);
    ASSERT_EQ(bus.sent.size(), 10u);
    for (std::size_t i = 0; i < 10; ++i)
      EXPECT_EQ(bus.sent[i].time_ns, 77 + static_cast<std::int64_t>(1e6 / pace) * static_cast<std::int64_t>(i));
  }
}

TEST(Replay, LeavesOutWhatTurnsMotorsUnlessAskedFor) {
  QueueBus without, with;
  EXPECT_EQ(play({}, without).commands_left_out, 10u);
  for (const StampedBusFrame& f : without.sent) EXPECT_EQ(f.frame.id, kEscStatusOf21);
  EXPECT_EQ(play({.with_commands = true}, with).sent, 20u);
}

}  // namespace
}  // namespace rotorloop::tools
