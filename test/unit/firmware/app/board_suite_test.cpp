// What every board must pass (docs/porting.md): one suite over all of them. A new board is one more type in Boards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/unit/firmware/app/board_benches.hpp"
#include "test/unit/firmware/app/board_rig.hpp"

namespace rotorloop::firmware {
namespace {

using ::testing::Types;

template <class Board>
class BoardSuite : public ::testing::Test {};
using Boards = Types<FakeBench, SimulatedBench, LiveBench>;
TYPED_TEST_SUITE(BoardSuite, Boards);

TYPED_TEST(BoardSuite, StartsAndAnnouncesItselfEverySecondWithTheBridgeOff) {
  BoardRig<TypeParam> rig;
  ASSERT_TRUE(rig.start());
  rig.sent.clear();
  rig.run_ms(3000);
  EXPECT_NEAR(static_cast<double>(rig.template received<protocols::NodeStatus>().size()), 3.0, 1.0);
  EXPECT_FALSE(rig.board.bridge());
  EXPECT_EQ(rig.board.cause(), ResetCause::power_on);
}

TYPED_TEST(BoardSuite, AnswersGetNodeInfoWithItsNameAndUniqueId) {
  BoardRig<TypeParam> rig;
  ASSERT_TRUE(rig.start());
  const auto info = rig.template ask<protocols::GetNodeInfoResponse>(protocols::GetNodeInfo{});
  ASSERT_TRUE(info);
  EXPECT_EQ(std::string(info->name.data(), info->name_length), "org.rotorloop.esc");
  EXPECT_EQ(info->unique_id, suite_identity().unique_id);
}

TYPED_TEST(BoardSuite, WithoutAnIdAsksAnAllocatorAndSpeaksUnderTheIdThatItGets) {
  BoardRig<TypeParam> rig(0);
  protocols::Allocation known{.node_id = 0, .first_part = false, .unique_id = {}};
  for (int part = 0; part < 3; ++part) {
    rig.sent.clear();
    ASSERT_TRUE(rig.run_until([&] { return !rig.sent.empty(); })) << "part " << part;
    const CanFrame f = rig.sent.front();
    EXPECT_EQ(protocols::decode_id(f.id).source, protocols::kNoNode);
    protocols::Allocation a;
    ASSERT_TRUE(decode(std::span<const std::uint8_t>(f.data.data(), f.length - 1u), a));
    for (const std::uint8_t byte : a.unique_id.view()) known.unique_id.push_back(byte);
    if (part == 2) known.node_id = 77;
    rig.broadcast(known);
  }
  rig.sent.clear();
  ASSERT_TRUE(rig.run_until([&] { return !rig.template received<protocols::NodeStatus>().empty(); }));
  EXPECT_EQ(protocols::decode_id(rig.sent.front().id).source, 77);
}

TYPED_TEST(BoardSuite, ParametersAreSetAndSurviveARestartOnlyWhenSaved) {
  BoardRig<TypeParam> rig;
  ASSERT_TRUE(rig.start());
  for (const bool saved : {false, true}) {
    const auto set = rig.parameter("cmd_timeout_ms", protocols::ParamValue::of(std::int64_t{400}));
    ASSERT_TRUE(set);
    EXPECT_EQ(set->value.integer, 400);
    if (saved) {
      EXPECT_TRUE(rig.save());
    }
    ASSERT_TRUE(rig.restart());
    ASSERT_TRUE(rig.start());
    const auto after = rig.parameter("cmd_timeout_ms");
    ASSERT_TRUE(after);
    EXPECT_EQ(after->value.integer, saved ? 400 : 250);
    EXPECT_EQ(rig.board.cause(), ResetCause::software);
  }
}

TYPED_TEST(BoardSuite, DrivesTheBridgeForAFreshCommandOnceArmedAndStopsAtTheTimeOut) {
  BoardRig<TypeParam> rig;
  ASSERT_TRUE(rig.start());
  rig.run_ms(1000);  // zeros of the current sensors, self-test
  EXPECT_FALSE(rig.command_for(300, 6000)) << "nobody has armed it";
  rig.arm();
  rig.run_ms(300);
  EXPECT_FALSE(rig.board.bridge()) << "the command from before the arming is old";
  rig.arm();
  EXPECT_TRUE(rig.command_for(300, 6000));
  rig.arm();
  rig.run_ms(245);  // time-out 250 ms after the command 10 ms ago
  const std::uint64_t kicks = rig.board.kicks();
  rig.run_ms(25);
  EXPECT_FALSE(rig.board.bridge());
  EXPECT_GT(rig.board.kicks(), kicks) << "a missing commander is no reason for a reset";
}

TYPED_TEST(BoardSuite, KicksTheWatchdogInEveryTurnOfTheLoop) {
  BoardRig<TypeParam> rig;
  ASSERT_TRUE(rig.start());
  const std::uint64_t before = rig.board.kicks();
  rig.run_ms(1000);
  EXPECT_NEAR(static_cast<double>(rig.board.kicks() - before), 1e6 / kPoll_us, 10.0);
}

// For boards whose bench can stop the interrupt alone.
template <class Board>
class BoardWithoutInterrupt : public ::testing::Test {};
using Stoppable = Types<FakeBench, SimulatedBench>;
TYPED_TEST_SUITE(BoardWithoutInterrupt, Stoppable);

TYPED_TEST(BoardWithoutInterrupt, LeavesTheWatchdogAloneThoughTheMainLoopStillAnswers) {
  BoardRig<TypeParam> rig;
  ASSERT_TRUE(rig.start());
  rig.board.stop_interrupt();
  rig.run_ms(1);
  const std::uint64_t before = rig.board.kicks();
  rig.run_ms(100);
  EXPECT_EQ(rig.board.kicks(), before);
  EXPECT_TRUE(rig.template ask<protocols::GetNodeInfoResponse>(protocols::GetNodeInfo{}));
}

TYPED_TEST(BoardSuite, ComesBackFromBusOffAndAnswersAgain) {
  BoardRig<TypeParam> rig(BoardRig<TypeParam>::kNode, 3'000'000);
  ASSERT_TRUE(rig.start());
  ASSERT_TRUE(rig.run_until([&] { return rig.board.bus() == BusState::bus_off; }, 6000));
  ASSERT_TRUE(rig.run_until([&] { return rig.board.bus() == BusState::error_active; }, 100));
  EXPECT_TRUE(rig.template ask<protocols::GetNodeInfoResponse>(protocols::GetNodeInfo{}));
}

TYPED_TEST(BoardSuite, AnUpdateThatTheBusHasBegunIsFoundAfterTheRestart) {
  BoardRig<TypeParam> rig;
  ASSERT_TRUE(rig.start());
  EXPECT_FALSE(rig.board.update_waits());
  const auto r =
      rig.template ask<protocols::BeginFirmwareUpdateResponse>(protocols::BeginFirmwareUpdate{.source_node_id = 0, .path = "esc.bin"});
  ASSERT_TRUE(r);
  EXPECT_EQ(r->error, protocols::BeginFirmwareUpdateResponse::Error::ok);
  EXPECT_TRUE(rig.run_until([&] { return rig.board.update_waits(); }));
}

TEST(EscApplication, CountsHowLongAFrameWaitedForItsTurnAndTheTurnsWithoutAnInterrupt) {
  FakeEscBoard board;
  EscFirmware<FakeEscBoard> esc(board, suite_identity());
  board.advance_to(1000);
  board.can().deliver(CanFrame{.id = 0x7FF});
  board.advance_to(1180);
  esc.on_sample(board);
  esc.poll(board);
  EXPECT_EQ(esc.application().counters().longest_wait_us, 180u);
  EXPECT_EQ(esc.application().counters().polls_without_sample, 0u);
  EXPECT_EQ(board.kicks, 1u);
  esc.poll(board);
  EXPECT_EQ(esc.application().counters().polls_without_sample, 1u);
  EXPECT_EQ(board.kicks, 1u);
}

// What only the port of a CAN FD controller has, and its order of sending.
TEST(FakeCanPort, OfThreeMailboxesTheSmallestIdentifierLeavesFirstAndAFourthFrameHasToWait) {
  FakeCan can;
  for (const std::uint32_t id : {0x300u, 0x100u, 0x200u}) EXPECT_TRUE(can.send(CanFrame{.id = id}));
  EXPECT_FALSE(can.ready());
  EXPECT_FALSE(can.send(CanFrame{.id = 1}));
  for (const std::uint32_t id : {0x100u, 0x200u, 0x300u}) EXPECT_EQ(can.take_sent().value().id, id);
  EXPECT_FALSE(can.take_sent());
}

TEST(FakeCanPort, AFilterPassesItsFramesOfBothKindsWithTheTimeOfTheirEnd) {
  FakeCan can;
  const std::array filters{CanFilter{.id = 0x120, .mask = 0x7F0, .extended = false}};
  ASSERT_TRUE(can.set_filters(filters));
  can.advance_to(700);
  EXPECT_FALSE(can.deliver(CanFrame{.id = 0x130}));
  EXPECT_TRUE(can.deliver(CanFrame{.id = 0x121}));
  EXPECT_TRUE(can.deliver(CanFdFrame{.id = 0x122, .length = 64}));
  can.advance_to(900);
  const auto classic = can.receive();
  ASSERT_TRUE(classic);
  EXPECT_EQ(classic->frame.id, 0x121u);
  EXPECT_EQ(classic->time_us, 700u);
  const auto fd = can.receive_fd();
  ASSERT_TRUE(fd);
  EXPECT_EQ(fd->frame.length, 64);
  EXPECT_FALSE(can.receive_fd());
}

}  // namespace
}  // namespace rotorloop::firmware
