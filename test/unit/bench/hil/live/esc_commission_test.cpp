// A commissioning of the whole ESC (firmware, drive, battery, propeller) by the tool, in virtual time: what it enters wrongly beforehand is
// measured, and what cannot be measured is said.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "host/base/error.hpp"
#include "host/tools/commission.hpp"
#include "sim/plant/plant_esc.hpp"
#include "test/unit/bench/hil/live/esc_bench.hpp"

namespace rotorloop::live {
namespace {

using firmware::MotorState;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

double number_of(const protocols::ParamValue& v) {
  return v.kind == protocols::ParamValue::Kind::real ? static_cast<double>(v.real) : static_cast<double>(v.integer);
}

// An ESC whose parameters are 40 % off, in force.
class CommissionBench : public EscBench {
 public:
  CommissionBench() : EscBench(Backend::virtual_bus) {
    power_on();
    discover();
    set("resistance", 0.085f);
    set("inductance", 21e-6f);
    set("flux_linkage", 4.6e-4f);
    set("inertia", 1.3e-5f);
    set("load", 5e-8f);
    tools::execute(tool(), kEscNode, tools::ParameterOrder::save);
    restart();
  }
  void set(const std::string& name, float value) {
    tools::set_parameter(tool(), kEscNode, tools::read_parameter(tool(), kEscNode, name), protocols::ParamValue::of(value));
  }
  void restart() {
    using protocols::RestartNode;
    const int starts = esc().starts();
    tool().ask<protocols::RestartNodeResponse>(kEscNode, RestartNode{.magic = RestartNode::kMagic});
    ASSERT_TRUE(tool().run_until(tool().now_ns() + 5 * kSecond_ns, [&] { return esc().starts() == starts + 1 && esc().operational(); }));
  }
  tools::CommissionReport run(
      const tools::CommissionOptions& options, const std::function<bool(tools::Commission&)>& go_on = [](auto&) { return true; }) {
    tools::Commission c(tool(), kEscNode, options, [&](const std::string& text) { said.push_back(text); });
    c.begin();
    const std::int64_t begun_ns = tool().now_ns();
    while (!c.over() && tool().now_ns() - begun_ns < 60 * kSecond_ns) {
      c.step(go_on(c));
      tool().run_for(5 * kMs_ns);
      if (esc().telemetry().state != MotorState::off) turned_by_motor_control = true;
      fastest_rad_s = std::max(fastest_rad_s, std::fabs(esc().omega_rad_s()));
    }
    took_s = static_cast<double>(tool().now_ns() - begun_ns) * 1e-9;
    return c.finish();
  }
  std::vector<std::string> said;
  bool turned_by_motor_control = false;
  double took_s = 0.0, fastest_rad_s = 0.0;
};

sim::DriveParameters truth(const EscBench& b) {
  const auto plant = sim::read_plant(b.config.plant);
  return sim::drive_parameters(plant, *sim::read_rotors(plant)[0], 0);
}

TEST(EscCommissioning, MeasuresItsMotorWhateverWasEnteredAndKeepsItOverARestart) {
  CommissionBench b;
  const tools::CommissionReport r = b.run({.speed_constant_rpm_V = 2300.0});
  ASSERT_EQ(r.end, "done") << (b.said.empty() ? "" : b.said.back());
  std::map<std::string, double> found;
  for (const auto& m : r.measured) found[m.name] = number_of(m.value);
  const sim::DriveParameters d = truth(b);
  // The limits of docs/acceptance/esc_commissioning.md.
  EXPECT_NEAR(found.at("resistance") / d.motor.resistance_ohm, 1.0, 0.05);
  EXPECT_NEAR(found.at("inductance") / (0.5 * (d.motor.inductance_H.d + d.motor.inductance_H.q)), 1.0, 0.10);
  EXPECT_NEAR(found.at("flux_linkage") / d.motor.flux_linkage_Wb, 1.0, 0.05);
  EXPECT_NEAR(found.at("inertia") / (d.motor.inertia_kg_m2 + d.blade_inertia_kg_m2), 1.0, 0.08);
  EXPECT_THAT(r.not_measured, ElementsAre("pole_pairs", "dir_reversed"));
  EXPECT_THAT(b.said, Contains("pole pairs 7 as entered, not measured; direction not measured"));
  EXPECT_THAT(b.said, Contains(HasSubstr("running: ")));
  EXPECT_FALSE(b.turned_by_motor_control);
  EXPECT_FALSE(b.esc().node().armed());
  RecordProperty("took_s", std::to_string(b.took_s));
  RecordProperty("messages", std::to_string(b.said.size()));
  tools::execute(b.tool(), kEscNode, tools::ParameterOrder::save);
  b.restart();
  EXPECT_NEAR(b.esc().node().parameters().resistance_ohm, found.at("resistance"), 1e-6);
  b.rpm_for(2.0, 6000, protocols::ArmingStatus::kFullyArmed);
  EXPECT_NEAR(b.esc().omega_rad_s() * 30.0 / std::numbers::pi, 6000.0, 60.0);
}

TEST(EscCommissioning, AtRestMovesTheRotorByNoMoreThanAHandDoesAndLeavesTheRest) {
  CommissionBench b;
  const tools::CommissionReport r = b.run({.spin = false});
  ASSERT_EQ(r.end, "done");
  EXPECT_EQ(r.measured.size(), 3u);
  EXPECT_THAT(r.not_measured, ElementsAre("flux_linkage", "inertia", "load", "pole_pairs", "dir_reversed"));
  EXPECT_EQ(b.esc().node().edited().flux_linkage_Wb, 4.6e-4f) << "as entered";
  EXPECT_LT(b.fastest_rad_s, 60.0);
}

// Somebody with a tachometer: counts what the true rotor does while it is held.
TEST(EscCommissioning, ACountedSpeedGivesThePolePairsAndASeenDirectionTurnsTheMotorRound) {
  CommissionBench b;
  bool counted = false;
  const tools::CommissionReport r = b.run({.count = true}, [&](tools::Commission& c) {
    if (c.wants_count() && !counted) {
      counted = true;
      c.counted(std::fabs(b.esc().omega_rad_s()) * 30.0 / std::numbers::pi, true);
    }
    return true;
  });
  ASSERT_EQ(r.end, "done");
  EXPECT_TRUE(counted);
  EXPECT_TRUE(r.not_measured.empty());
  EXPECT_THAT(b.said, Contains("pole pairs 7 measured; direction reversed, dir_reversed changed"));
  EXPECT_TRUE(b.esc().node().parameters().dir_reversed);
}

TEST(EscCommissioning, IsRefusedWhileSomebodyCommandsTheEscAndEndsWhenSomebodyBegins) {
  CommissionBench b;
  b.rpm_for(0.1, 0);
  try {
    b.run({});
    FAIL() << "an order of zero is fresh";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("commands for this ESC arrive"));
    EXPECT_EQ(e.exit_code(), ExitCode::device);
  }
  b.tool().run_for(kSecond_ns);
  const tools::CommissionReport r = b.run({}, [&](tools::Commission& c) {
    if (c.state().starts_with("running: 1")) b.rpm_for(0.02, 0);
    return true;
  });
  EXPECT_EQ(r.end, "ended: a command arrived");
  EXPECT_TRUE(r.measured.empty());
  EXPECT_EQ(b.esc().node().edited().resistance_ohm, 0.085f);
}

TEST(EscCommissioning, LettingGoAndASilentToolEndItWithTheBridgeOff) {
  CommissionBench b;
  const tools::CommissionReport r = b.run({}, [&](tools::Commission& c) { return !c.state().starts_with("running: 8"); });
  EXPECT_EQ(r.end, "ended: disarmed");
  EXPECT_LT(b.took_s, 30.0);
  // A tool that is killed in the middle of the spinning part: nothing is sent any more.
  b.tool().run_for(3 * kSecond_ns);
  bool bridge = false;
  double off_s = 0.0;
  b.esc().on_bridge = [&](const BridgeChange& change) {
    bridge = change.on;
    off_s = change.t_s;
  };
  tools::Commission c(b.tool(), kEscNode, {}, {});
  c.begin();
  b.tool().run_until(b.tool().now_ns() + 60 * kSecond_ns, [&] {
    c.step(true);
    return c.state().starts_with("running: 8");
  });
  ASSERT_TRUE(bridge);
  const std::int64_t killed_ns = b.tool().now_ns();
  b.let_pass(4 * kSecond_ns);
  EXPECT_FALSE(bridge);
  EXPECT_FALSE(b.esc().node().commissioning());
  b.expect_within("commissioning_without_its_tool", 1e3 * off_s - 1e-6 * static_cast<double>(killed_ns), 2600.0);
}

}  // namespace
}  // namespace rotorloop::live
