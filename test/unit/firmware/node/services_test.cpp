// What configuration tools and autopilots ask of the node: allocation, parameters, save, restart, enumeration, update, and what it says
// when something is wrong.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "firmware/board/fake/emulated_flash.hpp"
#include "firmware/core/node/node_store.hpp"
#include "test/unit/firmware/node/service_rig.hpp"

namespace rotorloop::firmware {
namespace {

using protocols::TransferKind;

TEST(NodeParameters, CanBeCountedByIndexWithoutGapsAndEachIsFoundByItsName) {
  ServiceRig rig;
  std::map<std::string, int> names;
  for (std::uint16_t i = 0;; ++i) {
    const auto r = rig.get<protocols::ParamGetSetResponse>(protocols::ParamGetSet{.index = i, .value = {}, .name = {}});
    if (r.name.count == 0) {
      EXPECT_EQ(r.value.kind, protocols::ParamValue::Kind::empty);
      EXPECT_EQ(i, ParameterServer::kCount);
      break;
    }
    EXPECT_LE(r.name.count, 16);
    names[text_of(r.name)] = i;
  }
  EXPECT_GE(names.size(), 44u + 12u);
  for (const auto& [name, index] : names) EXPECT_EQ(text_of(rig.parameter(name.c_str()).name), name);
  EXPECT_EQ(rig.parameter("no_such_name").name.count, 0);
}

TEST(NodeParameters, ComeWithTypeDefaultAndLimits) {
  ServiceRig rig;
  auto r = rig.parameter("pole_pairs");
  EXPECT_EQ(r.value, protocols::ParamValue::of(std::int64_t{7}));
  EXPECT_EQ(r.default_value, protocols::ParamValue::of(std::int64_t{7}));
  EXPECT_EQ(r.min_value, protocols::NumericValue::of(std::int64_t{1}));
  EXPECT_EQ(r.max_value, protocols::NumericValue::of(std::int64_t{32}));
  r = rig.parameter("overvoltage");
  EXPECT_EQ(r.value, protocols::ParamValue::of(28.0f));
  EXPECT_EQ(r.max_value, protocols::NumericValue::of(80.0f));
  r = rig.parameter("require_arming");
  EXPECT_EQ(r.value, protocols::ParamValue::of(true));
  EXPECT_EQ(r.max_value.kind, protocols::NumericValue::Kind::empty);
}

TEST(NodeParameters, SetValuesAreClampedConvertedAndRefusedWhenTheyContradictAnotherOne) {
  ServiceRig rig;
  EXPECT_EQ(rig.parameter("status_Hz", protocols::ParamValue::of(std::int64_t{1000})).value.integer, 200);
  EXPECT_EQ(rig.parameter("status_Hz", protocols::ParamValue::of(19.6f)).value.integer, 20);
  EXPECT_EQ(rig.parameter("overvoltage", protocols::ParamValue::of(std::int64_t{25})).value.real, 25.0f);
  EXPECT_EQ(rig.parameter("undervoltage", protocols::ParamValue::of(26.0f)).value.real, 12.0f) << "above the overvoltage";
  EXPECT_EQ(rig.parameter("max_speed", protocols::ParamValue::of(std::nanf(""))).value.real, 1780.0f);
  EXPECT_EQ(rig.parameter("esc_index", protocols::ParamValue::of(std::int64_t{-1})).value.integer, -1);
  EXPECT_EQ(rig.parameter("stat_faults", protocols::ParamValue::of(std::int64_t{9})).value.integer, 0) << "can only be read";
  EXPECT_EQ(rig.parameter("stat_duty_q").value.kind, protocols::ParamValue::Kind::real);
}

TEST(NodeParameters, SetWhileTheMotorRunsTakeEffectWhenItIsOff) {
  ServiceRig rig;
  rig.run();
  EXPECT_EQ(rig.parameter("status_Hz", protocols::ParamValue::of(std::int64_t{20})).value.integer, 20);
  EXPECT_EQ(rig.node.parameters().status_Hz, 50);
  EXPECT_EQ(rig.node.revision(), 0u);
  rig.disarm();
  rig.telemetry.state = MotorState::off;
  rig.poll();
  EXPECT_EQ(rig.node.parameters().status_Hz, 20);
  EXPECT_EQ(rig.node.revision(), 1u) << "the motor control has to be told";
}

TEST(NodeParameters, FiveAnswersAtOnceFitTheQueueAndAllLeaveWholeOneAPoll) {
  ServiceRig rig;
  rig.sent.clear();
  for (std::uint16_t i = 9; i < 14; ++i) rig.ask(protocols::ParamGetSet{.index = i, .value = {}, .name = {}});
  for (std::size_t polled = 1; polled <= 5; ++polled) {
    rig.node.poll(rig.now_us, rig.telemetry);
    while (const auto f = rig.node.next_frame()) rig.sent.push_back(*f);
    EXPECT_EQ(rig.received<protocols::ParamGetSetResponse>(TransferKind::response).size(), polled);
  }
  EXPECT_EQ(rig.node.counters().tx_overflow, 0u);
  EXPECT_EQ(rig.node.counters().service_overflow, 0u);
}

// What an answer costs in processor time bounds what a flood can take: docs/acceptance/dronecan.md has the figures.
TEST(NodeServices, AFloodOfRequestsGetsOneAnswerAPollAndCommandsAreFollowedMeanwhile) {
  ServiceRig rig;
  rig.arm();
  rig.sent.clear();
  for (int ms = 0; ms < 100; ++ms) {
    for (int i = 0; i < 40; ++i) rig.ask(protocols::GetNodeInfo{}, static_cast<std::uint8_t>(50 + i));
    rig.raw({0, 0, 4000, 0});
    rig.advance_us(1000);
    EXPECT_TRUE(rig.spins()) << ms;
  }
  EXPECT_LE(rig.received<protocols::GetNodeInfoResponse>(TransferKind::response).size(), 100u);
  EXPECT_GT(rig.node.counters().service_overflow, 0u);
  rig.disarm();
  rig.advance_us(50'000);
  EXPECT_EQ(rig.parameter("status_Hz").value.integer, 50) << "answers again";
}

TEST(NodeServices, RequestsToOtherNodesTakeNoPlaceOfOurs) {
  ServiceRig rig;
  for (int i = 0; i < 100; ++i) {
    CanFrame f{.id = 24u << 24 | 11u << 16 | 0x8000u | 43u << 8 | 0x80u | kHost, .extended = true, .length = 3, .data = {}};
    f.data[2] = 0xC0;
    rig.node.on_frame(f, rig.now_us);
  }
  EXPECT_EQ(rig.node.counters().service_overflow, 0u);
  EXPECT_EQ(rig.parameter("status_Hz").value.integer, 50);
}

TEST(NodeStore, SaveRestartAndReadBackOverFlashAndEraseGivesTheDefaultsBack) {
  EmulatedFlash flash(2);
  ParameterStore store(flash);
  store.save(valid_parameters());
  const auto restarted = [&] {
    ServiceRig rig(store.load().parameters);
    rig.node.report_store(store.load().state);
    return rig;
  };
  const auto opcode = [&](ServiceRig& rig, std::uint8_t code) {
    rig.sent.clear();
    rig.ask(protocols::ParamExecuteOpcode{.opcode = code, .argument = 0});
    rig.poll();
    serve_store(rig.node, store);
    rig.poll();
    const auto answers = rig.received<protocols::ParamExecuteOpcodeResponse>(TransferKind::response);
    return answers.size() == 1 && answers[0].ok;
  };
  ServiceRig first = restarted();
  first.parameter("cmd_timeout_ms", protocols::ParamValue::of(std::int64_t{400}));
  EXPECT_TRUE(opcode(first, protocols::ParamExecuteOpcode::kSave));
  ServiceRig second = restarted();
  EXPECT_EQ(second.parameter("cmd_timeout_ms").value.integer, 400);
  EXPECT_TRUE(opcode(second, protocols::ParamExecuteOpcode::kErase));
  EXPECT_EQ(second.parameter("cmd_timeout_ms").value.integer, 250);
  EXPECT_EQ(store.load().parameters.node_id, 0);
  EmulatedFlash empty(2);
  EXPECT_FALSE(make_node(ParameterStore(empty), {}).parameters_ok());
}

TEST(NodeStore, SaveEraseRestartUpdateAndEnumerationAreRefusedWhileTheMotorRuns) {
  ServiceRig rig;
  rig.run();
  EXPECT_FALSE(rig.get<protocols::ParamExecuteOpcodeResponse>(protocols::ParamExecuteOpcode{.opcode = 0, .argument = 0}).ok);
  EXPECT_FALSE(rig.get<protocols::ParamExecuteOpcodeResponse>(protocols::ParamExecuteOpcode{.opcode = 1, .argument = 0}).ok);
  EXPECT_FALSE(rig.get<protocols::RestartNodeResponse>(protocols::RestartNode{.magic = protocols::RestartNode::kMagic}).ok);
  const auto update = rig.get<protocols::BeginFirmwareUpdateResponse>(protocols::BeginFirmwareUpdate{.source_node_id = 0, .path = "a.bin"});
  EXPECT_EQ(update.error, protocols::BeginFirmwareUpdateResponse::Error::invalid_mode);
  EXPECT_EQ(text_of(update.message), "the motor is running");
  EXPECT_EQ(rig.get<protocols::EnumerationBeginResponse>(protocols::EnumerationBegin{.timeout_s = 10, .parameter = {}}).error,
            protocols::EnumerationBeginResponse::Error::invalid_mode);
  EXPECT_EQ(rig.node.request(), NodeRequest::none);
  EXPECT_EQ(rig.node.counters().refused_while_running, 5u);
  EXPECT_TRUE(rig.spins());
}

TEST(NodeStore, FlashThatDoesNotFinishIsAnsweredAsFailedWithinHalfASecond) {
  ServiceRig rig;
  rig.sent.clear();
  rig.ask(protocols::ParamExecuteOpcode{.opcode = 0, .argument = 0});
  rig.advance_us(502'000);
  const auto answers = rig.received<protocols::ParamExecuteOpcodeResponse>(TransferKind::response);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_FALSE(answers[0].ok);
}

TEST(NodeStore, EmptyStoreSpeaksWithHealthErrorSaysSoAndNeverSpinsUntilParametersWereSaved) {
  ServiceRig rig;
  rig.node.report_store(StoreState::empty);
  rig.advance_us(10'000);
  EXPECT_EQ(rig.node.health(), protocols::Health::error);
  ASSERT_FALSE(rig.logs().empty());
  EXPECT_NE(rig.logs()[0].find("no parameters stored"), std::string::npos);
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  EXPECT_FALSE(rig.spins());
  EXPECT_EQ(text_of(rig.parameter("stat_why_off").value.string), "parameters");
  rig.advance_us(300'000);  // no order any more
  rig.ask(protocols::ParamExecuteOpcode{.opcode = 0, .argument = 0});
  rig.poll();
  rig.node.complete(true);
  EXPECT_EQ(rig.node.health(), protocols::Health::ok);
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  EXPECT_TRUE(rig.spins());
}

TEST(NodeReports, WhatTheBoardHasToTellOfItsLastRunIsSaidOnceAsAWarning) {
  ServiceRig rig;
  rig.node.report_at_start("restarted by a watchdog");
  rig.advance_us(2'000'000);
  const auto logs = rig.logs();
  EXPECT_EQ(
      std::count_if(logs.begin(), logs.end(), [](const std::string& l) { return l.find("restarted by a watchdog") != std::string::npos; }),
      1);
}

TEST(NodeStore, ParameterOutOfRangeIsNamedAndTheNodeAnswersOnDefaultsUnderItsId) {
  Parameters p = valid_parameters();
  p.resistance_ohm = 99.0f;
  ServiceRig rig(p);
  rig.advance_us(10'000);
  EXPECT_EQ(rig.node.node_id(), 42);
  EXPECT_EQ(rig.node.health(), protocols::Health::error);
  ASSERT_FALSE(rig.logs().empty());
  EXPECT_EQ(rig.logs()[0], "parameter resistance is 99.0, allowed 0.0 to 10.0: on defaults, motor off");
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  EXPECT_FALSE(rig.spins());
  EXPECT_EQ(rig.parameter("resistance").value.real, Parameters{}.resistance_ohm);
}

TEST(NodeRestart, NeedsItsMagicNumberAndWaitsUntilTheAnswerHasLeft) {
  ServiceRig rig;
  EXPECT_FALSE(rig.get<protocols::RestartNodeResponse>(protocols::RestartNode{.magic = 1}).ok);
  rig.ask(protocols::RestartNode{.magic = protocols::RestartNode::kMagic});
  EXPECT_EQ(rig.node.request(), NodeRequest::none) << "its answer still waits for the bus";
  rig.sent.clear();
  rig.poll();
  EXPECT_TRUE(rig.received<protocols::RestartNodeResponse>(TransferKind::response).at(0).ok);
  EXPECT_EQ(rig.node.request(), NodeRequest::restart);
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  EXPECT_FALSE(rig.spins()) << "on its way out";
}

TEST(NodeUpdate, IsAnsweredBeforeTheHandOffAndKeepsPathServerAndOwnId) {
  ServiceRig rig;
  const std::string path(200, 'p');
  const auto r = rig.get<protocols::BeginFirmwareUpdateResponse>(protocols::BeginFirmwareUpdate{.source_node_id = 0, .path = path.c_str()});
  EXPECT_EQ(r.error, protocols::BeginFirmwareUpdateResponse::Error::ok);
  ASSERT_EQ(rig.node.request(), NodeRequest::update);
  EXPECT_EQ(rig.node.update().server, kHost) << "0 is the caller";
  EXPECT_EQ(rig.node.update().own_id, 42);
  EXPECT_EQ(text_of(rig.node.update().path), path);
  EXPECT_EQ(rig.get<protocols::BeginFirmwareUpdateResponse>(protocols::BeginFirmwareUpdate{.source_node_id = 0, .path = "b"}).error,
            protocols::BeginFirmwareUpdateResponse::Error::in_progress);
}

TEST(NodeUpdate, WithAPathOfMoreThan200BytesIsRefusedWithTheLimit) {
  using Response = protocols::BeginFirmwareUpdateResponse;
  ServiceRig rig;
  std::vector<std::uint8_t> payload(1 + 201, 'p');
  payload[0] = 0;
  rig.send_payload({.kind = TransferKind::request, .priority = 24, .data_type_id = Response::kType.id, .source = kHost, .destination = 42},
                   Response::kType.crc_seed(), payload);
  rig.poll();
  const auto answers = rig.received<Response>(TransferKind::response);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].error, Response::Error::unknown);
  EXPECT_EQ(text_of(answers[0].message), "no path of 1 to 200 bytes, or no such file server");
  EXPECT_EQ(rig.node.request(), NodeRequest::none);
}

TEST(NodeEnumeration, IndicatesTheMotorThatWasTurnedByHandWithTheNameOfTheIndexParameter) {
  for (const char* name : {"", "esc_index"}) {
    ServiceRig rig;
    const auto r = rig.get<protocols::EnumerationBeginResponse>(protocols::EnumerationBegin{.timeout_s = 65535, .parameter = name});
    EXPECT_EQ(r.error, protocols::EnumerationBeginResponse::Error::ok);
    rig.advance_us(5'000'000);
    EXPECT_TRUE(rig.received<protocols::EnumerationIndication>().empty());
    EXPECT_TRUE(rig.node.feels_for_hand());
    rig.node.on_hand(true);
    rig.advance_us(50'000);
    EXPECT_FALSE(rig.node.feels_for_hand());
    const auto sent = rig.received<protocols::EnumerationIndication>();
    ASSERT_EQ(sent.size(), 1u);
    EXPECT_EQ(text_of(sent[0].parameter), "esc_index");
    EXPECT_EQ(sent[0].value.kind, protocols::NumericValue::Kind::empty);
  }
  ServiceRig rig;
  EXPECT_EQ(rig.get<protocols::EnumerationBeginResponse>(protocols::EnumerationBegin{.timeout_s = 5, .parameter = "status_Hz"}).error,
            protocols::EnumerationBeginResponse::Error::invalid_parameter);
}

// The allocator of the specification: repeats what it knows, then gives the id.
TEST(NodeAllocation, TakesThreeRequestsOf6p6And4BytesAndTheNodeThenSpeaksUnderItsId) {
  Parameters p = valid_parameters();
  p.node_id = 0;
  p.preferred_id = 77;
  NodeIdentity identity;
  for (std::uint8_t k = 0; k < 16; ++k) identity.unique_id[k] = static_cast<std::uint8_t>(0xA0 + k);
  ServiceRig rig(p, identity);
  protocols::Allocation known{.node_id = 0, .first_part = false, .unique_id = {}};
  std::vector<std::size_t> sizes;
  std::uint64_t last_us = rig.now_us;
  for (int part = 0; part < 3; ++part) {
    rig.sent.clear();
    while (rig.sent.empty() && rig.now_us - last_us < 2'000'000) rig.advance_us(1000);
    ASSERT_EQ(rig.sent.size(), 1u);
    const CanFrame f = rig.sent[0];
    const auto id = protocols::decode_id(f.id);
    EXPECT_EQ(id.source, protocols::kNoNode);
    EXPECT_EQ(id.data_type_id, 1);
    protocols::Allocation a;
    ASSERT_TRUE(decode(std::span<const std::uint8_t>(f.data.data(), f.length - 1u), a));
    EXPECT_EQ(a.first_part, part == 0);
    EXPECT_EQ(a.node_id, 77);
    const std::uint64_t waited_us = rig.now_us - last_us;
    EXPECT_GE(waited_us, part == 0 ? 600'000u - 1000u : 0u);
    EXPECT_LE(waited_us, part == 0 ? 1'001'000u : 401'000u);
    sizes.push_back(a.unique_id.count);
    for (const std::uint8_t b : a.unique_id.view()) known.unique_id.push_back(b);
    if (part == 2) known.node_id = 77;
    last_us = rig.now_us;
    rig.send(known, 126);
  }
  EXPECT_EQ(sizes, (std::vector<std::size_t>{6, 6, 4}));
  EXPECT_EQ(rig.node.node_id(), 77);
  rig.sent.clear();
  rig.advance_us(1'000'000);
  EXPECT_GE(rig.received<protocols::NodeStatus>().size(), 1u);
  EXPECT_EQ(rig.sent[0].id & 127u, 77u);
}

TEST(NodeAllocation, AnswerForAnotherNodeRestartsTheWaitingAndGivesNoId) {
  Parameters p = valid_parameters();
  p.node_id = 0;
  ServiceRig rig(p);
  for (int n = 0; n < 20; ++n) {
    protocols::Allocation other{.node_id = 9, .first_part = false, .unique_id = {}};
    for (std::uint8_t k = 0; k < 16; ++k) other.unique_id.push_back(static_cast<std::uint8_t>(200 + k));
    rig.send(other, 126);
    rig.advance_us(500'000);
  }
  EXPECT_EQ(rig.node.node_id(), 0);
  EXPECT_TRUE(rig.sent.empty()) << "every 500 ms somebody else is served: the first part waits 600 ms at least";
}

TEST(NodeConflicts, FrameWithOurNodeIdSilencesTheNodeFor3sAndThenItSaysSo) {
  ServiceRig rig;
  rig.sent.clear();
  rig.send(protocols::NodeStatus{}, 42);
  rig.advance_us(2'990'000);
  EXPECT_TRUE(rig.sent.empty());
  rig.advance_us(20'000);
  EXPECT_EQ(rig.received<protocols::NodeStatus>().at(0).health, protocols::Health::error);
  EXPECT_EQ(rig.logs().at(0), "another node has node id 42");
}

TEST(NodeConflicts, FeedbackOfAnotherEscWithOurIndexStopsOursAndIsReported) {
  ServiceRig rig;
  rig.arm();
  rig.fast(900.0f);
  rig.poll();
  ASSERT_EQ(rig.feedback().size(), 1u);
  const CanFrame foreign = encode(rig.feedback().back());
  rig.node.on_frame(foreign, rig.now_us);
  rig.sent.clear();
  for (int n = 0; n < 10; ++n) {
    rig.fast(900.0f);
    rig.poll();
  }
  EXPECT_TRUE(rig.feedback().empty());
  EXPECT_TRUE(rig.spins()) << "in flight a stray frame must not stop the motor";
  EXPECT_EQ(rig.node.health(), protocols::Health::error);
  EXPECT_EQ(rig.logs().at(0), "another ESC has esc_index 2: fast feedback stopped");
}

TEST(NodeReports, TwoCommandersAreCountedReportedAndAWarning) {
  ServiceRig rig;
  rig.arm();
  rig.send(protocols::RawCommand{.command = {0, 0, 4000, 0}, .count = 4}, 10);
  rig.send(protocols::RawCommand{.command = {0, 0, 3000, 0}, .count = 4}, 11);
  rig.poll();
  EXPECT_EQ(rig.node.command_counters().second_commander, 1u);
  EXPECT_EQ(rig.node.health(), protocols::Health::warning);
  EXPECT_EQ(rig.logs().at(0), "two commanders: nodes 10 and 11");
  rig.advance_us(1'100'000);
  EXPECT_EQ(rig.node.health(), protocols::Health::ok);
}

TEST(NodeReports, NotStartingIsExplainedOnceSomebodyOrders) {
  ServiceRig rig;
  rig.advance_us(1'000'000);
  EXPECT_TRUE(rig.logs().empty());
  for (int n = 0; n < 40; ++n) {
    rig.raw({0, 0, 4000, 0});
    rig.advance_us(10'000);
  }
  EXPECT_EQ(rig.logs(), std::vector<std::string>{"not starting: not armed"});
  EXPECT_EQ(text_of(rig.parameter("stat_why_off").value.string), "not armed");
}

TEST(NodeReports, TripThatEndedIsAWarningForTenSecondsAndItsCircumstancesCanBeRead) {
  ServiceRig rig;
  rig.run();
  rig.telemetry.fault = Fault::overcurrent;
  rig.telemetry.state = MotorState::fault;
  rig.telemetry.current_q_A = 43.5f;
  rig.telemetry.speed_rad_s = 9000.0f * kRpm;
  rig.advance_us(2'000);
  EXPECT_EQ(rig.node.health(), protocols::Health::warning) << "it tries again: an autopilot must not take the motor for lost";
  rig.telemetry.latched = true;
  rig.telemetry.blocked = Blocked::latched;
  rig.poll();
  EXPECT_EQ(rig.node.health(), protocols::Health::error);
  EXPECT_EQ(text_of(rig.parameter("stat_why_off").value.string), "motor control, too many faults: order zero first, overcurrent");
  rig.telemetry.latched = false;
  rig.telemetry.blocked = Blocked::none;
  rig.telemetry.fault = Fault::none;
  rig.advance_us(5'000'000);
  EXPECT_EQ(rig.node.health(), protocols::Health::warning);
  rig.advance_us(5'100'000);
  EXPECT_EQ(rig.node.health(), protocols::Health::ok);
  EXPECT_EQ(text_of(rig.parameter("stat_fault_1").value.string), "overcurrent at 16.0 V 43.5 A 9000 rpm 39.9 C, uptime 0 s");
  EXPECT_EQ(rig.parameter("stat_faults").value.integer, 1);
}

TEST(NodeReports, ABrokenFetFoundByTheSelfTestIsAnErrorNamedInLogReasonAndRecord) {
  ServiceRig rig;
  rig.run();
  rig.telemetry.state = MotorState::off;
  rig.telemetry.fault = Fault::self_test;
  rig.telemetry.latched = true;
  rig.telemetry.blocked = Blocked::broken;
  rig.telemetry.self_test.result = SelfTest::failed;
  rig.telemetry.self_test.broken = Broken::high_open;
  rig.telemetry.self_test.leg = 1;
  rig.advance_us(2'000);
  EXPECT_EQ(rig.node.health(), protocols::Health::error);
  EXPECT_EQ(rig.logs(), std::vector<std::string>{"self-test: FET B high open at 16.0 V 0.0 A 0 rpm 39.9 C, uptime 0 s"});
  rig.arm();
  rig.raw({0, 0, 4096, 0});
  rig.advance_us(2'000);
  EXPECT_EQ(text_of(rig.parameter("stat_why_off").value.string), "motor control, self-test failed, FET B high open");
  EXPECT_EQ(text_of(rig.parameter("stat_fault_1").value.string), "self-test: FET B high open at 16.0 V 0.0 A 0 rpm 39.9 C, uptime 0 s");
}

TEST(NodeReports, ASelfTestSkippedBecauseTheRotorTurnedIsSaidOnce) {
  ServiceRig rig;
  rig.run();
  rig.telemetry.self_test.result = SelfTest::turning;
  rig.advance_us(500'000);
  EXPECT_EQ(rig.logs(), std::vector<std::string>{"self-test: not tested, the rotor turns"});
  EXPECT_EQ(rig.node.health(), protocols::Health::ok);
}

TEST(NodeOrders, RawModeSpeedAndThrustReachTheSpeedLoop) {
  Parameters p = valid_parameters();
  p.raw_mode = RawMode::speed;
  ServiceRig speed(p);
  speed.arm();
  speed.raw({0, 0, 4096, 0});
  EXPECT_EQ(speed.setpoint().mode, Mode::speed);
  EXPECT_NEAR(speed.setpoint().value, 0.5f * p.max_speed_rad_s, 0.2f);
  p.raw_mode = RawMode::thrust;
  ServiceRig thrust(p);
  thrust.arm();
  thrust.raw({0, 0, 2048, 0});
  EXPECT_NEAR(thrust.setpoint().value, 0.5f * p.max_speed_rad_s, 0.2f) << "a quarter of the thrust at half the speed";
}

TEST(NodeOrders, NegativeOrdersTurnNothingBackwardsUnlessBidirectionalAndReversingChangesBothSigns) {
  Parameters p = valid_parameters();
  p.bidirectional = false;
  ServiceRig one_way(p);
  one_way.arm();
  one_way.raw({0, 0, -4000, 0});
  EXPECT_FALSE(one_way.spins());
  one_way.rpm({0, 0, -8000, 0});
  EXPECT_FALSE(one_way.spins());
  one_way.fast(-5.0f, protocols::fast::SetpointMode::current);
  EXPECT_FALSE(one_way.spins()) << "a resting rotor";
  one_way.telemetry.state = MotorState::running;
  one_way.telemetry.speed_valid = true;
  one_way.telemetry.speed_rad_s = 900.0f;
  one_way.poll();
  EXPECT_EQ(one_way.setpoint().value, -5.0f) << "braking";
  p.dir_reversed = true;
  ServiceRig reversed(p);
  reversed.arm();
  reversed.rpm({0, 0, 8000, 0});
  EXPECT_NEAR(reversed.setpoint().value, -8000.0f * kRpm, 0.1f) << "in the motor's own sense";
  reversed.telemetry.state = MotorState::running;
  reversed.telemetry.speed_valid = true;
  reversed.telemetry.speed_rad_s = -8000.0f * kRpm;
  reversed.sent.clear();
  reversed.advance_us(600'000);
  EXPECT_EQ(reversed.received<protocols::EscStatus>().back().rpm, 8000);
}

TEST(NodeOrders, BeepSoundsForItsDurationAndOnlyWhileNobodyHasArmed) {
  ServiceRig rig;
  rig.send(protocols::BeepCommand{.frequency_Hz = 440.0f, .duration_s = 0.1f});
  EXPECT_EQ(rig.setpoint().mode, Mode::tone);
  EXPECT_EQ(rig.setpoint().value, 440.0f);
  rig.advance_us(101'000);
  EXPECT_FALSE(rig.spins());
  rig.send(protocols::BeepCommand{.frequency_Hz = std::nanf(""), .duration_s = 1.0f});
  rig.send(protocols::BeepCommand{.frequency_Hz = 5.0f, .duration_s = 1.0f});
  EXPECT_FALSE(rig.spins());
  rig.send(protocols::BeepCommand{.frequency_Hz = 440.0f, .duration_s = 60000.0f});
  rig.arm();
  EXPECT_FALSE(rig.spins()) << "armed: no more sounds";
  rig.disarm();
  rig.advance_us(2'001'000);
  EXPECT_FALSE(rig.spins()) << "2 s at most";
}

TEST(NodeOrders, ZeroFirstWaitsForAnOrderOfZeroAfterArming) {
  Parameters p = valid_parameters();
  p.zero_first = true;
  ServiceRig rig(p);
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  EXPECT_FALSE(rig.spins());
  rig.raw({0, 0, 0, 0});
  rig.raw({0, 0, 4000, 0});
  EXPECT_TRUE(rig.spins());
}

TEST(NodeOrders, WithoutAnIndexNothingIsObeyedAndNoStatusIsSent) {
  Parameters p = valid_parameters();
  p.esc_index = kNoEscIndex;
  ServiceRig rig(p);
  rig.arm();
  rig.raw({4000, 4000, 4000, 4000});
  rig.fast(900.0f);
  EXPECT_FALSE(rig.spins());
  rig.advance_us(2'000'000);
  EXPECT_TRUE(rig.received<protocols::EscStatus>().empty());
  EXPECT_TRUE(rig.feedback().empty());
  rig.parameter("esc_index", protocols::ParamValue::of(std::int64_t{1}));
  rig.poll();
  rig.raw({0, 4000, 0, 0});
  EXPECT_TRUE(rig.spins());
}

TEST(NodeOrders, FastSetpointsOfAHostWithAnotherVersionAreRefusedAndBothNumbersSaid) {
  ServiceRig rig;
  rig.arm();
  rig.node.on_frame(protocols::fast::encode_version(0, 2), rig.now_us);
  rig.fast(900.0f);
  EXPECT_FALSE(rig.spins());
  EXPECT_EQ(rig.node.counters().fast_version, 1u);
  rig.poll();
  EXPECT_EQ(rig.logs().at(0), "fast channel: the host has version 2, this ESC 1: set-points refused");
  rig.node.on_frame(protocols::fast::encode_version(0), rig.now_us);
  rig.fast(900.0f);
  EXPECT_TRUE(rig.spins());
}

TEST(NodeTelemetry, ExtendedStatusAndRpmComeAtTheirRatesWhenTheyAreAskedFor) {
  Parameters p = valid_parameters();
  p.extended_Hz = 10;
  p.rpm_Hz = 100;
  ServiceRig rig(p);
  rig.sent.clear();
  rig.advance_us(2'000'000);
  EXPECT_EQ(rig.received<protocols::EscStatusExtended>().size(), 20u);
  EXPECT_EQ(rig.received<protocols::RpmSensor>().size(), 200u);
}

TEST(NodeHostile, UnansweredFloodsOfEveryServiceLeaveParametersAndMotorAsTheyWere) {
  ServiceRig rig;
  rig.run();
  rig.sent.clear();
  const Setpoint before = rig.setpoint();
  for (int n = 0; n < 500; ++n) {
    rig.ask(protocols::ParamExecuteOpcode{.opcode = static_cast<std::uint8_t>(n), .argument = n});
    rig.ask(protocols::RestartNode{.magic = static_cast<std::uint64_t>(n)});
    rig.ask(protocols::BeginFirmwareUpdate{.source_node_id = 0, .path = "x"});
  }
  EXPECT_EQ(rig.setpoint().value, before.value);
  EXPECT_EQ(rig.node.request(), NodeRequest::none);
  rig.telemetry.state = MotorState::running;
  rig.now_us += 100'000;
  rig.poll();
  EXPECT_GE(rig.received<protocols::EscStatus>().size(), 1u) << "telemetry keeps its room in the queue";
}

}  // namespace
}  // namespace rotorloop::firmware
