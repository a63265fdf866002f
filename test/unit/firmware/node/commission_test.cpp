// A commissioning over the bus: who may begin it, what ends it, what becomes of its result. The measuring has tests of its own
// (test/unit/firmware/commission), and so has the whole ESC (test/unit/bench/hil/live).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "test/unit/firmware/node/service_rig.hpp"

namespace rotorloop::firmware {
namespace {

using protocols::ParamValue;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr float kSwitch_ohm = 0.002f;

class CommissionRig : public ServiceRig {
 public:
  explicit CommissionRig(const Parameters& p = valid_parameters(), bool has_one = true) : ServiceRig(p) {
    if (has_one) node.on_commissioning({}, kSwitch_ohm);
  }
  std::int64_t begin(int task) { return parameter("commission", ParamValue::of(std::int64_t{task})).value.integer; }
  std::string state() { return text_of(parameter("stat_commission").value.string); }
  // As the commissioning reports while it runs, and how it ends.
  void report(CommissioningPhase phase, float progress, CommissioningEnd end = CommissioningEnd::none) {
    result.number = 1;
    result.phase = phase;
    result.progress = progress;
    result.end = end;
    node.on_commissioning(result, kSwitch_ohm);
    poll();
  }
  void measure_standstill() {
    result.standstill_valid = true;
    result.resistance_ohm = 0.05f + kSwitch_ohm;
    result.inductance_d_H = 12e-6f;
    result.inductance_q_H = 15e-6f;
    result.dead_time_s = 400e-9f;
  }
  void measure_spin() {
    result.spin_valid = true;
    result.flux_linkage_Wb = 5e-4f;
    result.inertia_kg_m2 = 2e-5f;
    result.load_N_m_s2 = 4e-8f;
  }
  CommissioningResult result{};
};

TEST(NodeCommissioning, BeginsWhenArmedAndAskedForAndOrdersNothingElseMeanwhile) {
  CommissionRig rig;
  rig.arm();
  EXPECT_EQ(rig.begin(2), 2);
  EXPECT_EQ(rig.node.commissioning_order().task, CommissioningTask::all);
  EXPECT_FALSE(rig.node.commissioning_order().wait_for_reference);
  EXPECT_TRUE(rig.node.commissioning());
  rig.advance_us(60'000);
  EXPECT_EQ(rig.received<protocols::NodeStatus>().back().mode, protocols::NodeMode::maintenance);
  EXPECT_EQ(text_of(rig.parameter("stat_why_off").value.string), "commissioning");
  EXPECT_FALSE(rig.spins());
  EXPECT_EQ(rig.begin(1), 2) << "one is under way";
}

TEST(NodeCommissioning, PassesOnWhatItComparesWithAndWhatSomebodyCounted) {
  CommissionRig rig;
  rig.parameter("commission_kv", ParamValue::of(2300.0f));
  EXPECT_EQ(rig.parameter("commission_bell", ParamValue::of(1.0f)).value.real, 0.1f) << "clamped";
  rig.arm();
  rig.begin(3);
  EXPECT_TRUE(rig.node.commissioning_order().wait_for_reference);
  EXPECT_EQ(rig.node.commissioning_order().speed_constant_rpm_V, 2300.0f);
  EXPECT_EQ(rig.node.commissioning_order().counted_rad_s, 0.0f);
  rig.report(CommissioningPhase::speed_held, 0.75f);
  EXPECT_THAT(rig.logs(), Contains(HasSubstr("speed held: count it")));
  rig.parameter("commission_dir", ParamValue::of(std::int64_t{2}));
  rig.parameter("commission_rpm", ParamValue::of(1200.0f));
  EXPECT_EQ(rig.node.commissioning_order().direction, SeenDirection::reversed);
  EXPECT_NEAR(rig.node.commissioning_order().counted_rad_s, 1200.0f * kRpm, 1e-3f);
}

TEST(NodeCommissioning, IsRefusedByName) {
  CommissionRig without(valid_parameters(), false);
  without.arm();
  EXPECT_EQ(without.begin(1), 0);
  EXPECT_EQ(without.state(), "refused: this firmware has none");

  CommissionRig rig;
  EXPECT_EQ(rig.begin(1), 0);
  EXPECT_EQ(rig.state(), "refused: not armed");
  EXPECT_EQ(rig.node.commissioning_order().task, CommissioningTask::off);
  rig.arm();
  rig.raw({0, 0, 0, 0});
  EXPECT_EQ(rig.begin(1), 0);
  EXPECT_EQ(rig.state(), "refused: commands for this ESC arrive") << "an order of zero is one";
  rig.telemetry.state = MotorState::running;
  rig.advance_us(400'000);
  EXPECT_EQ(rig.begin(1), 0);
  EXPECT_EQ(rig.state(), "refused: the motor is running");
  EXPECT_EQ(rig.begin(-1), 0) << "out of range: no order at all";
  EXPECT_EQ(rig.parameter("commission", ParamValue::of(std::nanf(""))).value.integer, 0);
}

TEST(NodeCommissioning, RefusesSaveRestartAndEnumerationWhileItRuns) {
  CommissionRig rig;
  rig.arm();
  rig.begin(1);
  rig.get<protocols::ParamExecuteOpcodeResponse>(protocols::ParamExecuteOpcode{});
  EXPECT_EQ(rig.node.request(), NodeRequest::none);
  EXPECT_FALSE(rig.get<protocols::RestartNodeResponse>(protocols::RestartNode{.magic = protocols::RestartNode::kMagic}).ok);
  EXPECT_EQ(rig.node.counters().refused_while_running, 2u);
}

void expect_ended(CommissionRig& rig, const std::string& why) {
  EXPECT_EQ(rig.node.commissioning_order().task, CommissioningTask::off) << why;
  rig.report(CommissioningPhase::finished, 1.0f, CommissioningEnd::cancelled);
  EXPECT_FALSE(rig.node.commissioning()) << why;
  EXPECT_EQ(rig.state(), "ended: " + why);
  EXPECT_EQ(rig.node.edited().resistance_ohm, Parameters{}.resistance_ohm) << "nothing of it is used";
}

TEST(NodeCommissioning, EndsAtOnceByDisarmingByAnyCommandAndByAsking) {
  const auto begun = [](const auto& end_it) {
    auto rig = std::make_unique<CommissionRig>();
    rig->arm();
    rig->begin(2);
    rig->measure_standstill();
    rig->report(CommissioningPhase::ramp, 0.7f);
    end_it(*rig);
    rig->poll();
    return rig;
  };
  expect_ended(*begun([](CommissionRig& r) { r.disarm(); }), "disarmed");
  expect_ended(*begun([](CommissionRig& r) { r.raw({0, 0, 0, 0}); }), "a command arrived");
  expect_ended(*begun([](CommissionRig& r) { r.fast(500.0f); }), "a command arrived");
  expect_ended(*begun([](CommissionRig& r) { r.begin(0); }), "asked to stop");
}

TEST(NodeCommissioning, EndsWhenTheNodeThatBeganItIsSilentFor2500msAndNotWhileItSaysAnything) {
  CommissionRig rig;
  rig.arm();
  rig.begin(2);
  rig.report(CommissioningPhase::align, 0.1f);
  for (int i = 0; i < 4; ++i) {
    rig.advance_us(2'000'000);
    rig.send(protocols::NodeStatus{}, kHost);
  }
  EXPECT_TRUE(rig.node.commissioning());
  for (int i = 0; i < 3; ++i) {
    rig.send(protocols::NodeStatus{}, kHost - 1);  // another one
    rig.advance_us(850'000);
  }
  expect_ended(rig, "the node that began it is silent");
}

TEST(NodeCommissioning, WhatWasMeasuredBecomesParametersAndWhatWasNotIsSaid) {
  CommissionRig rig;
  rig.arm();
  rig.begin(2);
  rig.measure_standstill();
  rig.report(CommissioningPhase::ramp, 0.7f);
  rig.advance_us(1'100'000);
  EXPECT_THAT(rig.logs(), Contains("R 52.0 mohm with switches, L_d 12.0 uH, L_q 15.0 uH, dead time 400.0 ns"));
  EXPECT_THAT(rig.logs(), Contains("running: 70 %, ramp"));
  EXPECT_EQ(rig.node.edited().resistance_ohm, Parameters{}.resistance_ohm) << "not before it is over";
  rig.measure_spin();
  rig.report(CommissioningPhase::finished, 1.0f, CommissioningEnd::done);
  EXPECT_THAT(rig.logs(), Contains("flux 500.0 uWb, inertia 20000.0e-9 kg m2, friction 0.0 uN m, load 40.0e-9 N m s2"));
  EXPECT_THAT(rig.logs(), Contains("pole pairs 7 as entered, not measured; direction not measured"));
  EXPECT_EQ(rig.state(), "done");
  EXPECT_NEAR(rig.node.edited().resistance_ohm, 0.05f, 1e-7f);
  EXPECT_NEAR(rig.node.edited().inductance_H, 13.5e-6f, 1e-12f);
  EXPECT_EQ(rig.node.edited().flux_linkage_Wb, 5e-4f);
  EXPECT_EQ(rig.node.edited().pole_pairs, 7);
  EXPECT_THAT(text_of(rig.parameter("stat_restart").value.string), HasSubstr("resistance"));
  EXPECT_EQ(rig.parameter("commission").value.integer, 0);
}

TEST(NodeCommissioning, PolePairsAndDirectionAreTakenWhereTheyWereCountedAndSeen) {
  CommissionRig rig;
  rig.arm();
  rig.begin(3);
  rig.measure_standstill();
  rig.measure_spin();
  rig.result.pole_pairs = 6;
  rig.result.direction = SeenDirection::reversed;
  rig.report(CommissioningPhase::finished, 1.0f, CommissioningEnd::done);
  EXPECT_THAT(rig.logs(), Contains("pole pairs 6 measured; direction reversed, dir_reversed changed"));
  EXPECT_EQ(rig.node.edited().pole_pairs, 6);
  EXPECT_TRUE(rig.node.edited().dir_reversed);
}

TEST(NodeCommissioning, AResultThatCannotBeIsRefusedByNameAndChangesNothing) {
  CommissionRig rig;
  rig.arm();
  rig.begin(2);
  rig.measure_standstill();
  rig.report(CommissioningPhase::finished, 1.0f, CommissioningEnd::does_not_turn);
  EXPECT_EQ(rig.state(), "ended: the rotor does not turn");
  EXPECT_EQ(rig.node.edited().resistance_ohm, Parameters{}.resistance_ohm);
  rig.advance_us(1'000'000);
  // Measured pole pairs so many that max_speed is beyond the observer.
  rig.begin(3);
  rig.result = {};
  rig.measure_standstill();
  rig.measure_spin();
  rig.result.pole_pairs = 20;
  rig.result.phase = CommissioningPhase::finished;
  rig.result.number = 2;
  rig.result.end = CommissioningEnd::done;
  rig.node.on_commissioning(rig.result, kSwitch_ohm);
  rig.poll();
  EXPECT_THAT(rig.logs(), Contains(HasSubstr("max_speed contradicts")));
  EXPECT_EQ(rig.state(), "ended: what was measured contradicts another parameter");
  EXPECT_EQ(rig.node.edited().pole_pairs, 7);
}

}  // namespace
}  // namespace rotorloop::firmware
