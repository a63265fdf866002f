// Before an update: is a node in use, who commands, which board a node is, how long it takes; and an update that somebody else has begun.
#include "host/tools/update_plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "test/unit/host/tools/tool_pair.hpp"

namespace rotorloop::tools {
namespace {

using namespace protocols;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

SeenNode named(const std::string& name) {
  SeenNode n;
  n.info.emplace();
  n.info->set_name(name.c_str());
  return n;
}

// The node sends `message` every 100 ms while the tool listens for 2 s.
template <class Message>
void send_for_2_s(Pair& p, const Message& message) {
  std::int64_t next_ns = 0;
  p.on_tick = [&p, message, next_ns]() mutable {
    if (p.node.now_ns() < next_ns) return;
    next_ns = p.node.now_ns() + 100 * kMs_ns;
    p.node.broadcast(message, 8);
  };
  p.tool.run_for(2 * kSecond_ns);
  p.on_tick = {};
}

TEST(CommandWatch, ANodeThatTurnsIsInUseUntilItReportsStandstill) {
  Pair p;
  const CommandWatch watch(p.tool);
  EscStatus s;
  s.rpm = -3000;
  send_for_2_s(p, s);
  EXPECT_EQ(watch.in_use(21), "turns with -3000 rpm");
  s.rpm = 0;
  send_for_2_s(p, s);
  EXPECT_EQ(watch.in_use(21), "");
}

TEST(CommandWatch, WhoeverSendsSetPointsOrArmingCommandsUntilItIsSilentForOneAndAHalfSeconds) {
  RawCommand raw;
  raw.count = 4;
  RpmCommand rpm;
  rpm.count = 4;
  const auto commanders = [](const auto& message) {
    Pair p;
    const CommandWatch watch(p.tool);
    EXPECT_THAT(watch.commanders(), IsEmpty());
    send_for_2_s(p, message);
    const auto heard = watch.commanders();
    p.tool.run_for(CommandWatch::kRecent_ns + 100 * kMs_ns);
    EXPECT_THAT(watch.commanders(), IsEmpty());
    return heard;
  };
  EXPECT_THAT(commanders(raw), ElementsAre(21));
  EXPECT_THAT(commanders(rpm), ElementsAre(21));
  EXPECT_THAT(commanders(ArmingStatus{.status = ArmingStatus::kDisarmed}), ElementsAre(21));
  EXPECT_THAT(commanders(EscStatus{}), IsEmpty());
}

TEST(CommandWatch, EveryEscIsTakenToBeArmedWhileSomebodySendsFullyArmed) {
  Pair p;
  const CommandWatch watch(p.tool);
  send_for_2_s(p, ArmingStatus{.status = ArmingStatus::kDisarmed});
  EXPECT_EQ(watch.in_use(22), "");
  send_for_2_s(p, ArmingStatus{.status = ArmingStatus::kFullyArmed});
  EXPECT_EQ(watch.in_use(22), "is armed");
  p.tool.run_for(CommandWatch::kRecent_ns + 100 * kMs_ns);
  EXPECT_EQ(watch.in_use(22), "");
}

TEST(CommandWatch, TheArmedFlagIsReadOfRotorloopsEscsAlone) {
  EscStatusExtended armed;
  armed.status_flags = 1u << 16;
  Pair ours("org.rotorloop.esc"), others("com.example.esc");
  const CommandWatch watch_ours(ours.tool), watch_others(others.tool);
  send_for_2_s(ours, armed);
  send_for_2_s(others, armed);
  EXPECT_EQ(watch_ours.in_use(21), "is armed");
  EXPECT_EQ(watch_others.in_use(21), "") << "the bit means what its maker says";
  send_for_2_s(ours, EscStatusExtended{});
  EXPECT_EQ(watch_ours.in_use(21), "");
}

TEST(UpdatePlan, ABoardIsAWholePartOfTheNodesName) {
  EXPECT_TRUE(is_board(named("org.rotorloop.b_g431b_esc1"), "b_g431b_esc1"));
  EXPECT_TRUE(is_board(named("org.rotorloop.b_g431b_esc1.test_key"), "b_g431b_esc1"));
  EXPECT_TRUE(is_board(named("com.example.esc"), "com.example.esc"));
  EXPECT_FALSE(is_board(named("org.rotorloop.b_g431b_esc10"), "b_g431b_esc1"));
  EXPECT_FALSE(is_board(named("org.rotorloop.xb_g431b_esc1"), "b_g431b_esc1"));
  EXPECT_FALSE(is_board(SeenNode{}, "b_g431b_esc1"));
}

TEST(UpdatePlan, FourNodesTakeLessThanThreeTimesOne) {
  EXPECT_NEAR(expected_update_s(94'712, 1), 6.4, 0.1);
  EXPECT_LT(expected_update_s(94'712, 4), 3.0 * expected_update_s(94'712, 1));
}

TEST(UpdatePlan, TheRemainingTimeIsByThePaceSinceTheFirstBlockAlsoOfAnUpdateThatGoesOn) {
  UpdateState s;
  s.phase = UpdatePhase::reading;
  s.read_B = s.first_B = 50'000;
  s.first_ns = kSecond_ns;
  EXPECT_FALSE(remaining_s(s, 90'000, 2 * kSecond_ns)) << "no pace yet";
  s.read_B = 70'000;
  EXPECT_NEAR(remaining_s(s, 90'000, 2 * kSecond_ns).value(), 1.0, 1e-9);
  s.phase = UpdatePhase::restarting;
  EXPECT_FALSE(remaining_s(s, 90'000, 2 * kSecond_ns));
}

// A bootloader that fetches an image from another program, which falls silent after `other_ends_s`; then it reads here, one block.
UpdateState asked_while_another_serves(double other_ends_s) {
  Pair p;
  std::vector<std::uint8_t> questions;
  p.node.serve<BeginFirmwareUpdate, BeginFirmwareUpdateResponse>([&](const BeginFirmwareUpdate& q, std::uint8_t client) {
    BeginFirmwareUpdateResponse r;
    if (static_cast<double>(p.node.now_ns()) * 1e-9 < other_ends_s) {
      r.error = BeginFirmwareUpdateResponse::Error::in_progress;
    } else {
      p.node.request<FileRead, FileReadResponse>(client, {.offset = 0, .path = q.path}, [](const auto&) {});
    }
    return std::optional(r);
  });
  FirmwareUpdates updates(p.tool, std::vector<std::uint8_t>(1000, 7));
  updates.start(21);
  p.tool.run_until(60 * kSecond_ns, [&] { return updates.step(), updates.over() || updates.nodes().at(21).read_B > 0; });
  return updates.nodes().at(21);
}

TEST(FirmwareUpdates, ANodeThatAnotherProgramUpdatesIsNamedSoAndNothingIsClaimed) {
  const UpdateState s = asked_while_another_serves(1e9);
  EXPECT_EQ(s.phase, UpdatePhase::failed);
  EXPECT_EQ(s.failure, UpdateFailure::elsewhere);
  EXPECT_THAT(s.reason, HasSubstr("is updated by another program"));
  EXPECT_THAT(remedy_of(s.failure), HasSubstr("end the other program"));
}

TEST(FirmwareUpdates, ANodeWhoseOtherProgramFellSilentIsAskedAgainAndReadsHere) {
  const UpdateState s = asked_while_another_serves(7.0);
  EXPECT_EQ(s.phase, UpdatePhase::reading) << s.reason;
  EXPECT_EQ(s.read_B, 256u);
}

}  // namespace
}  // namespace rotorloop::tools
