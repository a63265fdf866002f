// The node as a bus participant: identity, health, telemetry rates, feedback, a queue that never loses whole-ness.
#include "firmware/core/node/esc_node.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "test/unit/firmware/node/esc_rig.hpp"

namespace rotorloop::firmware {
namespace {

using protocols::EscStatus;
using protocols::GetNodeInfo;
using protocols::GetNodeInfoResponse;
using protocols::Health;
using protocols::NodeMode;
using protocols::NodeStatus;
using protocols::TransferKind;

void ask_node_info(EscRig& rig) {
  rig.send_payload({.kind = TransferKind::request, .priority = 30, .data_type_id = 1, .source = kHost, .destination = 42},
                   GetNodeInfo::kType.crc_seed(), {});
}

TEST(EscNode, NodeStatusComesOncePerSecondFromTheStartAndCountsUptime) {
  EscRig rig;
  rig.sent.clear();
  rig.advance_us(10'000'000);
  const auto status = rig.received<NodeStatus>();
  ASSERT_EQ(status.size(), 10u);
  EXPECT_EQ(status.back().uptime_s - status.front().uptime_s, 9u);
  EXPECT_EQ(status.back().health, Health::ok);
  EXPECT_EQ(status.back().mode, NodeMode::operational);
}

TEST(EscNode, AnnouncesInitializationFirstAndOperationalWhenReady) {
  EscNode node(valid_parameters(), {});
  EscRig decoder;  // only for its decoding
  node.hold_initialization(true);
  decoder.sent.clear();
  std::uint64_t now_us = 1000;
  const auto run = [&](int ms) {
    for (int i = 0; i < ms; ++i, now_us += 1000) {
      node.poll(now_us, warm_telemetry());
      while (const auto f = node.next_frame()) decoder.sent.push_back(*f);
    }
  };
  run(300);
  node.hold_initialization(false);
  run(300);
  const auto status = decoder.received<NodeStatus>();
  ASSERT_EQ(status.size(), 2u);
  EXPECT_EQ(status[0].mode, NodeMode::initialization);
  EXPECT_EQ(status[1].mode, NodeMode::operational) << "told at once, not a second later";
}

TEST(EscNode, MotorStaysOffDuringInitialization) {
  EscRig rig;
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  rig.node.hold_initialization(true);
  EXPECT_FALSE(rig.spins());
  rig.node.hold_initialization(false);
  rig.poll();
  EXPECT_TRUE(rig.spins());
}

TEST(EscNode, LatchedFaultIsHealthErrorWithItsCodeWithin50ms) {
  EscRig rig;
  rig.advance_us(200'000);
  rig.sent.clear();
  rig.telemetry.fault = Fault::stall;
  rig.telemetry.latched = true;
  rig.telemetry.limiter = Limiter::voltage;
  rig.advance_us(50'000);
  auto status = rig.received<NodeStatus>();
  ASSERT_EQ(status.size(), 1u);
  EXPECT_EQ(status[0].health, Health::error);
  EXPECT_EQ(status[0].vendor_status, 0x0404);
  rig.telemetry.fault = Fault::none;
  rig.telemetry.latched = false;
  rig.telemetry.limiter = Limiter::temperature;
  rig.advance_us(100'000);
  status = rig.received<NodeStatus>();
  EXPECT_EQ(status.back().health, Health::warning);
}

TEST(EscNode, FlickeringFaultDoesNotFloodTheBus) {
  EscRig rig;
  rig.sent.clear();
  for (int i = 0; i < 1000; ++i) {
    rig.telemetry.fault = (i & 1) != 0 ? Fault::stall : Fault::none;
    rig.advance_us(1000);
  }
  EXPECT_LE(rig.received<NodeStatus>().size(), 21u);
}

TEST(EscNode, AnswersGetNodeInfoInTheSamePollWithTheRequestsPriorityAndTransferId) {
  NodeIdentity identity;
  identity.unique_id = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
  identity.vcs_commit = 0xABCDEF01;
  EscRig rig(valid_parameters(), identity);
  rig.sent.clear();
  ask_node_info(rig);
  rig.poll();
  const auto info = rig.received<GetNodeInfoResponse>(TransferKind::response);
  ASSERT_EQ(info.size(), 1u);
  EXPECT_EQ(std::string(info[0].name.data(), info[0].name_length), "org.rotorloop.esc");
  EXPECT_EQ(info[0].unique_id, identity.unique_id);
  EXPECT_EQ(info[0].vcs_commit, 0xABCDEF01u);
  EXPECT_EQ(info[0].software_flags, 1);
  EXPECT_EQ(protocols::decode_id(rig.sent[0].id).priority, 30);
  EXPECT_EQ(protocols::decode_id(rig.sent[0].id).destination, kHost);
  EXPECT_EQ(rig.sent[0].data[7] & 31, 0) << "first transfer of the host";
}

TEST(EscNode, RequestsForAnotherNodeAreNotAnswered) {
  EscRig rig;
  rig.sent.clear();
  rig.send_payload({.kind = TransferKind::request, .priority = 30, .data_type_id = 1, .source = kHost, .destination = 43},
                   GetNodeInfo::kType.crc_seed(), {});
  rig.poll();
  EXPECT_TRUE(rig.received<GetNodeInfoResponse>(TransferKind::response).empty());
}

TEST(EscNode, EscStatusIsSentAtItsRateRunningAndTwicePerSecondIdle) {
  EscRig rig;
  rig.sent.clear();
  rig.advance_us(4'000'000);
  EXPECT_EQ(rig.received<EscStatus>().size(), 8u);
  rig.sent.clear();
  rig.telemetry.state = MotorState::running;
  rig.advance_us(2'000'000);
  EXPECT_NEAR(static_cast<double>(rig.received<EscStatus>().size()), 100.0, 1.0);
}

TEST(EscNode, FirstStatusAfterStartDoesNotWaitForTheIdlePeriod) {
  EscRig rig;
  rig.advance_us(1'010'000);
  rig.sent.clear();
  rig.telemetry.state = MotorState::running;
  rig.advance_us(21'000);  // seen running at the first poll, due 20 ms after it
  EXPECT_EQ(rig.received<EscStatus>().size(), 1u);
}

TEST(EscNode, EscStatusIsInDroneCanUnits) {
  EscRig rig;
  rig.telemetry = {.state = MotorState::running,
                   .fault = Fault::none,
                   .limiter = Limiter::none,
                   .speed_valid = true,
                   .speed_rad_s = -937.2418f,
                   .current_q_A = -11.0f,
                   .bus_V = 15.5f,
                   .bus_A = -4.0f,
                   .temperature_K = 320.0f,
                   .error_count = 77};
  rig.sent.clear();
  rig.advance_us(100'000);
  const auto status = rig.received<EscStatus>();
  ASSERT_FALSE(status.empty());
  EXPECT_EQ(status[0].rpm, -8950) << "reverse is negative";
  EXPECT_EQ(status[0].voltage_V, 15.5f);
  EXPECT_EQ(status[0].current_A, -4.0f) << "regeneration is negative";
  EXPECT_EQ(status[0].temperature_K, 320.0f);
  EXPECT_EQ(status[0].power_rating_pct, 10);
  EXPECT_EQ(status[0].error_count, 77u);
  EXPECT_EQ(status[0].esc_index, 2);
  rig.telemetry.speed_valid = false;
  rig.advance_us(100'000);
  EXPECT_EQ(rig.received<EscStatus>().back().rpm, 0);
}

TEST(EscNode, FourEscsSwitchedOnTogetherSpreadTheirStatus) {
  std::vector<std::uint64_t> first_us;
  for (std::uint8_t index = 0; index < 4; ++index) {
    Parameters p = valid_parameters();
    p.esc_index = index;
    EscNode node(p, {});
    for (std::uint64_t t_us = 1000; first_us.size() <= index; t_us += 1000) {
      node.poll(t_us, warm_telemetry());
      while (const auto f = node.next_frame()) {
        if (protocols::decode_id(f->id).data_type_id == EscStatus::kType.id && first_us.size() <= index) first_us.push_back(t_us);
      }
    }
  }
  for (std::size_t i = 1; i < 4; ++i) EXPECT_GE(first_us[i], first_us[i - 1] + 2000) << "1.3 ms of bus time each";
}

TEST(EscNode, FeedbackLeavesInThePollAfterTheSetpointWithItsSequenceAndFreshTelemetry) {
  EscRig rig;
  rig.arm();
  rig.fast_with_sequence(11, 900.0f);
  EXPECT_TRUE(rig.feedback().empty());
  rig.telemetry.speed_valid = true;
  rig.telemetry.speed_rad_s = 894.0f;
  rig.telemetry.current_q_A = 7.5f;
  rig.poll();
  ASSERT_EQ(rig.feedback().size(), 1u);
  EXPECT_EQ(rig.feedback()[0].sequence, 11);
  EXPECT_EQ(rig.feedback()[0].esc_index, 2);
  EXPECT_NEAR(rig.feedback()[0].speed_rad_s(), 894.0f, 0.06f);
  EXPECT_NEAR(rig.feedback()[0].current_A(), 7.5f, 0.026f);
  EXPECT_FALSE(rig.feedback()[0].bus_10mV);
  rig.poll();
  EXPECT_EQ(rig.feedback().size(), 1u) << "one answer per set-point";
}

TEST(EscNode, FeedbackRateIsDividedOnSequenceNumbersThatAllEscsShare) {
  for (const auto& [rate_Hz, divider] : {std::pair{1000, 1}, {500, 2}, {250, 4}}) {
    Parameters p = valid_parameters();
    p.fast_feedback_Hz = static_cast<std::uint16_t>(rate_Hz);
    EscRig rig(p);
    for (int i = 0; i < 160; ++i) {
      rig.advance_us(1000);
      rig.fast(900.0f);
    }
    rig.poll();
    EXPECT_EQ(rig.feedback().size(), 160u / static_cast<unsigned>(divider)) << rate_Hz;
    for (const auto& f : rig.feedback()) EXPECT_EQ(f.sequence % divider, 0);
  }
  Parameters p = valid_parameters();
  p.fast_feedback_Hz = 0;
  EscRig rig(p);
  rig.fast(900.0f);
  rig.poll();
  EXPECT_TRUE(rig.feedback().empty());
}

TEST(EscNode, UnlockedObserverGivesUnknownSpeedAndVoltageIsOptional) {
  NodeIdentity identity;
  identity.feedback_with_voltage = true;
  EscRig rig(valid_parameters(), identity);
  rig.telemetry.speed_rad_s = 500.0f;
  rig.fast(900.0f);
  rig.poll();
  ASSERT_EQ(rig.feedback().size(), 1u);
  EXPECT_FALSE(rig.feedback()[0].speed_valid());
  EXPECT_EQ(rig.feedback()[0].bus_10mV, 1600);
}

TEST(EscNode, BusyBusKeepsOnlyTheNewestFeedback) {
  EscRig rig;
  for (int i = 0; i < 5; ++i) {
    rig.fast(900.0f);
    rig.now_us += 1000;
    rig.node.poll(rig.now_us, rig.telemetry);  // nobody takes the frames
  }
  rig.poll();
  ASSERT_EQ(rig.feedback().size(), 1u);
  EXPECT_EQ(rig.feedback()[0].sequence, 5);
  EXPECT_EQ(rig.node.counters().feedback_superseded, 4u);
}

TEST(EscNode, FeedbackOvertakesALongAnswer) {
  EscRig rig;
  rig.sent.clear();
  ask_node_info(rig);
  rig.fast(900.0f);
  rig.poll();
  ASSERT_GT(rig.sent.size(), 8u);
  EXPECT_TRUE(protocols::fast::decode_feedback(rig.sent[0]));
}

TEST(EscNode, FloodOfRequestsLosesWholeAnswersAndLeavesRoomForTelemetry) {
  EscRig rig;
  rig.sent.clear();
  for (int i = 0; i < 50; ++i) {  // and the bus takes nothing meanwhile
    ask_node_info(rig);
    rig.node.poll(rig.now_us, rig.telemetry);
  }
  EXPECT_GT(rig.node.counters().tx_overflow, 0u);
  rig.telemetry.fault = Fault::stall;
  rig.now_us += 1'000'000;
  rig.poll();
  EXPECT_EQ(rig.received<NodeStatus>().size(), 1u);
  const std::size_t frames = rig.sent.size();
  EXPECT_LE(frames, 64u);
  EXPECT_EQ(rig.received<GetNodeInfoResponse>(TransferKind::response).size(), 6u) << "what was sent is whole";
}

TEST(EscNode, ArmingStatusOfWrongSizeArmsNothingAndMalformedSetpointsAreCounted) {
  EscRig rig;
  rig.send_payload({.kind = TransferKind::message, .priority = 7, .data_type_id = protocols::ArmingStatus::kType.id, .source = kHost}, 0,
                   {});
  EXPECT_EQ(rig.node.counters().payload_wrong_size, 1u);
  const std::array<std::uint8_t, 2> longer{255, 0};
  rig.send_payload({.kind = TransferKind::message, .priority = 7, .data_type_id = protocols::ArmingStatus::kType.id, .source = kHost}, 0,
                   longer);
  EXPECT_EQ(rig.node.counters().payload_wrong_size, 2u);
  EXPECT_FALSE(rig.node.armed());
  CanFrame f = encode(protocols::fast::Setpoint{});
  f.length = 7;
  rig.node.on_frame(f, rig.now_us);
  EXPECT_EQ(rig.node.counters().fast_malformed, 1u);
}

}  // namespace
}  // namespace rotorloop::firmware
