// What an integrator expects of an ESC, asked of the whole ESC (firmware, drive, flash) by the tools, on each backend by the same tests.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "host/bus/frame_bits.hpp"
#include "host/tools/allocator.hpp"
#include "host/tools/esc_table.hpp"
#include "host/tools/parameters.hpp"
#include "protocols/fast_channel.hpp"
#include "test/unit/bench/hil/live/esc_bench.hpp"

namespace rotorloop::live {
namespace {

using namespace protocols;
using firmware::MotorState;

constexpr std::uint8_t kArmed = ArmingStatus::kFullyArmed, kDisarmed = ArmingStatus::kDisarmed;

// Frames of higher priority than any answer, from nodes that are not there, filling a bus of 1 Mbit/s to a share.
class Load {
 public:
  Load(EscBench& bench, double share) : bench_(bench), share_(share) {}
  void step(std::int64_t now_ns) {
    if (begun_ns_ == 0) begun_ns_ = now_ns;
    const double due_bits = share_ * 1e-3 * static_cast<double>(now_ns - begun_ns_);
    while (bits_ < due_bits) {
      // Commands of zero for others: type 1030 from node 10, and what looks like set-points of other groups.
      CanFrame f{.id = number_ % 2 == 0 ? 0x0704060Au : 0x0A3u, .extended = number_ % 2 == 0, .length = 8, .data = {}};
      f.data[7] = static_cast<std::uint8_t>(0xC0u | (number_ / 2 & 31u));
      bits_ += frame_bits(f) + kIntermissionBits;
      ++number_;
      bench_.send_foreign(BusFrame(f));
    }
  }

 private:
  EscBench& bench_;
  double share_, bits_ = 0.0;
  std::int64_t begun_ns_ = 0;
  std::uint64_t number_ = 0;
};

void set(EscBench& b, const std::string& name, const std::string& text) {
  const auto p = tools::read_parameter(b.tool(), kEscNode, name);
  tools::set_parameter(b.tool(), kEscNode, p, tools::parse_value(p, text, name));
}

std::string get(EscBench& b, const std::string& name) { return tools::value_text(tools::read_parameter(b.tool(), kEscNode, name).value); }

void restart(EscBench& b) {
  const int starts = b.esc().starts();
  const auto r = b.tool().ask<RestartNodeResponse>(kEscNode, RestartNode{.magic = RestartNode::kMagic});
  ASSERT_TRUE(r && r->ok);
  ASSERT_TRUE(
      b.tool().run_until(b.tool().now_ns() + 5 * kSecond_ns, [&] { return b.esc().starts() == starts + 1 && b.esc().operational(); }));
}

bool begin_enumeration(EscBench& b, std::uint16_t timeout_s) {
  EnumerationBegin q;
  q.timeout_s = timeout_s;
  q.parameter = Text<kMaxParameterName>("esc_index");
  const auto r = b.tool().ask<EnumerationBeginResponse>(kEscNode, q);
  return r && r->error == EnumerationBeginResponse::Error::ok;
}

TEST_P(EscOnABus, IsFoundWithItsNameUniqueIdVersionAndImageCrc) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  const tools::SeenNode& n = b.tool().nodes().at(kEscNode);
  EXPECT_EQ(tools::node_name(n), "org.rotorloop.esc");
  EXPECT_EQ(n.info->unique_id, b.config.unique_id);
  EXPECT_EQ(n.info->software_flags & GetNodeInfoResponse::kHasImageCrc, GetNodeInfoResponse::kHasImageCrc);
  EXPECT_EQ(n.info->image_crc, b.esc().image().crc);
}

TEST_P(EscOnABus, FortyParametersAndMoreAreReadWithinTwoSeconds) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  const std::int64_t begun_ns = b.tool().now_ns();
  const auto read = tools::read_parameters(b.tool(), kEscNode);
  b.expect_within("parameters", static_cast<double>(b.tool().now_ns() - begun_ns) * 1e-6, 2000.0);
  EXPECT_GE(read.size(), 40u);
  EXPECT_EQ(read.size(), firmware::ParameterServer::kCount);
}

// Four requests are begun anew whenever one of the five is answered, over the whole list; names, values, defaults and limits are those that
// an idle bus gives.
TEST_P(EscOnABus, FiveRequestsInFlightAreAnsweredWithin100MsOnABusLoadedTo70Percent) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  const auto idle = tools::read_parameters(b.tool(), kEscNode);
  Load load(b, 0.70);
  b.on_tick = [&](std::int64_t now_ns) { load.step(now_ns); };
  b.tool().run_for(100 * kMs_ns);
  std::size_t next = 0, open = 0, answered = 0;
  double longest_ms = 0.0;
  const std::function<void()> ask_next = [&] {
    while (open < 5 && next < idle.size()) {
      const std::size_t i = next++;
      ++open;
      ParamGetSet q;
      q.index = static_cast<std::uint16_t>(i);
      const std::int64_t asked_ns = b.tool().now_ns();
      b.tool().request<ParamGetSet, ParamGetSetResponse>(
          kEscNode, q,
          [&, i, asked_ns](const std::optional<ParamGetSetResponse>& r) {
            --open;
            longest_ms = std::max(longest_ms, static_cast<double>(b.tool().now_ns() - asked_ns) * 1e-6);
            if (r && std::string(r->name.items.begin(), r->name.items.begin() + r->name.count) == idle[i].name &&
                tools::same_value(r->value, idle[i].value))
              ++answered;
            ask_next();
          },
          {.attempts = 1});
    }
  };
  ask_next();
  b.tool().run_until(b.tool().now_ns() + 60 * kSecond_ns, [&] { return open == 0; });
  EXPECT_EQ(answered, idle.size());
  b.expect_within("longest_answer", longest_ms, 100.0);
}

TEST_P(EscOnABus, WhatIsSetAndSavedIsThereAfterARestartAndAfterAKill) {
  EscBench b(GetParam());
  b.config.store = folder_.path() / "esc.flash";
  b.power_on();
  b.discover();
  set(b, "status_Hz", "77");
  tools::execute(b.tool(), kEscNode, tools::ParameterOrder::save);
  set(b, "status_idle_Hz", "5");  // not saved
  ASSERT_NO_FATAL_FAILURE(restart(b));
  EXPECT_EQ(get(b, "status_Hz"), "77");
  EXPECT_EQ(get(b, "status_idle_Hz"), "2");
  b.power_off();
  b.power_on();
  EXPECT_TRUE(b.esc().parameters_stored());
  EXPECT_EQ(get(b, "status_Hz"), "77");
}

TEST_P(EscOnABus, ConstantsOfTheMotorAreInForceAfterARestartAndTheNodeSaysSo) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  EXPECT_EQ(tools::waits_for_restart(b.tool(), kEscNode), "");
  set(b, "resistance", "0.05");
  set(b, "status_Hz", "60");
  EXPECT_EQ(tools::waits_for_restart(b.tool(), kEscNode), "resistance");
  tools::execute(b.tool(), kEscNode, tools::ParameterOrder::save);
  ASSERT_NO_FATAL_FAILURE(restart(b));
  EXPECT_EQ(tools::waits_for_restart(b.tool(), kEscNode), "");
  EXPECT_EQ(b.esc().node().parameters().resistance_ohm, 0.05f);
}

TEST_P(EscOnABus, IsEnumeratedByItsButton) {
  EscBench b(GetParam());
  b.config.esc_index = firmware::kNoEscIndex;
  b.power_on();
  std::vector<int> indicated;
  b.tool().on<EnumerationIndication>([&](const EnumerationIndication&, std::uint8_t source) { indicated.push_back(source); });
  b.discover();
  b.esc().press_button();  // no enumeration: nobody asked
  b.tool().run_for(200 * kMs_ns);
  ASSERT_TRUE(begin_enumeration(b, 30));
  EXPECT_TRUE(indicated.empty());
  b.esc().press_button();
  EXPECT_TRUE(b.tool().run_until(b.tool().now_ns() + 2 * kSecond_ns, [&] { return !indicated.empty(); }));
  EXPECT_EQ(indicated, std::vector<int>{kEscNode});
  set(b, "esc_index", "3");
  tools::execute(b.tool(), kEscNode, tools::ParameterOrder::save);
  ASSERT_NO_FATAL_FAILURE(restart(b));
  EXPECT_EQ(b.esc().esc_index(), 3);
}

TEST_P(EscOnABus, IsEnumeratedByAHandThatTurnsItsRotorInEitherSenseOnceAndByNothingElse) {
  EscBench b(GetParam());
  b.power_on();
  int indicated = 0;
  b.tool().on<EnumerationIndication>([&](const EnumerationIndication&, std::uint8_t) { ++indicated; });
  b.discover();
  b.esc().turn_by_hand(30.0);
  b.tool().run_for(kSecond_ns);
  EXPECT_EQ(indicated, 0) << "nobody asked";
  EXPECT_FALSE(b.esc().windings_shorted());
  b.esc().turn_by_hand(std::nullopt);
  int expected = 0;
  for (const double speed_rad_s : {-60.0, 10.0, 25.0}) {
    ASSERT_TRUE(begin_enumeration(b, 60));
    b.tool().run_for(2 * kSecond_ns);
    EXPECT_EQ(indicated, expected) << "at rest";
    EXPECT_TRUE(b.esc().node().enumerating());
    const std::int64_t begun_ns = b.tool().now_ns();
    b.esc().turn_by_hand(speed_rad_s);
    EXPECT_TRUE(b.tool().run_until(begun_ns + 5 * kSecond_ns, [&] { return indicated > expected; })) << speed_rad_s << " rad/s";
    b.expect_within("hand_at_" + std::to_string(static_cast<int>(speed_rad_s)), static_cast<double>(b.tool().now_ns() - begun_ns) * 1e-6,
                    2.0 * 6283.2 / std::fabs(speed_rad_s));
    b.tool().run_for(kSecond_ns);
    EXPECT_EQ(indicated, ++expected) << "once, however long the hand goes on";
    EXPECT_FALSE(b.esc().windings_shorted());
    b.esc().turn_by_hand(std::nullopt);
  }
}

TEST_P(EscOnABus, ItsWindingsAreShortedOnlyWhileAnEnumerationWaits) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  bool shorted = false;
  b.on_tick = [&](std::int64_t) { shorted = shorted || b.esc().windings_shorted(); };
  const auto shorted_within = [&](std::int64_t ns) {
    shorted = false;
    b.tool().run_for(ns);
    return shorted;
  };
  EXPECT_FALSE(shorted_within(kSecond_ns));
  ASSERT_TRUE(begin_enumeration(b, 2));
  EXPECT_TRUE(shorted_within(kSecond_ns));
  b.tool().run_for(1500 * kMs_ns);
  EXPECT_FALSE(shorted_within(kSecond_ns)) << "its time is over";
  ASSERT_TRUE(begin_enumeration(b, 60));
  EXPECT_TRUE(shorted_within(kSecond_ns));
  ASSERT_TRUE(begin_enumeration(b, EnumerationBegin::kCancel));
  b.tool().run_for(100 * kMs_ns);
  EXPECT_FALSE(shorted_within(kSecond_ns)) << "cancelled";
  ASSERT_TRUE(begin_enumeration(b, 60));
  EXPECT_TRUE(shorted_within(kSecond_ns));
  b.tool().broadcast(ArmingStatus{.status = kArmed}, 8);
  b.tool().run_for(100 * kMs_ns);
  EXPECT_FALSE(shorted_within(kSecond_ns)) << "armed";
  EXPECT_FALSE(begin_enumeration(b, 60)) << "armed: refused";
}

TEST_P(EscOnABus, AnEnumerationEndsForAnOrderAndTheMotorTurns) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  ASSERT_TRUE(begin_enumeration(b, 30));
  b.tool().run_for(300 * kMs_ns);
  b.rpm_for(1.5, 4000, kArmed);
  EXPECT_FALSE(b.esc().node().enumerating());
  EXPECT_EQ(b.esc().telemetry().state, MotorState::running);
}

TEST_P(EscOnABus, AsksForANodeIdAndGetsTheSameOneAfterAKill) {
  EscBench b(GetParam());
  b.config.node_id = 0;
  std::vector<tools::Allocated> given;
  tools::Allocator allocator(b.tool(), {}, [&](const tools::Allocated& a) { given.push_back(a); });
  for (int i = 0; i < 2; ++i) {
    b.power_on();
    ASSERT_TRUE(b.tool().run_until(b.tool().now_ns() + 20 * kSecond_ns, [&] { return b.esc().node_id() != 0; }));
    EXPECT_EQ(b.esc().node_id(), 125);
    b.power_off();
  }
  EXPECT_EQ(allocator.table().size(), 1u);
  EXPECT_EQ(allocator.table().begin()->first, b.config.unique_id);
}

TEST_P(EscOnABus, TurnsOnlyWhenArmedAndStopsWhenDisarmed) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  b.rpm_for(0.5, 4000);
  EXPECT_EQ(b.esc().telemetry().state, MotorState::off);
  b.rpm_for(0.3, 4000, std::uint8_t{128});  // neither disarmed nor fully armed
  EXPECT_EQ(b.esc().telemetry().state, MotorState::off);
  b.rpm_for(1.5, 4000, kArmed);
  EXPECT_EQ(b.esc().telemetry().state, MotorState::running);
  b.rpm_for(0.3, 4000, kDisarmed);
  EXPECT_EQ(b.esc().telemetry().state, MotorState::off);
}

TEST_P(EscOnABus, HoldsItsSpeedWithinOnePercentAndTheBridgeIsOff250MsAfterTheLastCommand) {
  EscBench b(GetParam());
  b.power_on();
  tools::EscTable table(b.tool());
  b.discover();
  b.rpm_for(2.0, 6000, kArmed);
  const tools::EscRow* row = table.of_index(0);
  ASSERT_NE(row, nullptr);
  EXPECT_NEAR(row->status.rpm, 6000, 60);
  EXPECT_NEAR(b.esc().omega_rad_s() * 30.0 / 3.14159265, 6000.0, 60.0) << "of the true rotor";
  ASSERT_EQ(b.esc().telemetry().state, MotorState::running);
  std::int64_t off_ns = 0;
  b.on_tick = [&](std::int64_t now_ns) {
    if (off_ns == 0 && b.esc().telemetry().state == MotorState::off) off_ns = now_ns;
  };
  const std::int64_t last_ns = b.tool().now_ns();
  b.rpm_for(0.005, 6000);  // one more command, the last
  ASSERT_TRUE(b.tool().run_until(last_ns + 10 * kSecond_ns, [&] { return off_ns != 0; }));
  b.expect_within("bridge_off", static_cast<double>(off_ns - last_ns) * 1e-6, 250.0);
}

TEST_P(EscOnABus, TurnsByRawCommandsInProportionAndTheBridgeIsOff250MsAfterTheLastOne) {
  EscBench b(GetParam());
  b.power_on();
  tools::EscTable table(b.tool());
  b.discover();
  RawCommand c;
  c.count = 1;
  std::vector<int> rpm;
  for (const std::int16_t value : {std::int16_t{1500}, std::int16_t{3000}}) {
    c.command[0] = value;
    b.command_for(
        1.5, [&] { b.tool().broadcast(c, 7); }, kArmed);
    ASSERT_NE(table.of_index(0), nullptr);
    rpm.push_back(table.of_index(0)->status.rpm);
  }
  EXPECT_GT(rpm[0], 1500);
  EXPECT_GT(rpm[1], 1.5 * rpm[0]);
  ASSERT_EQ(b.esc().telemetry().state, MotorState::running);
  std::int64_t off_ns = 0;
  b.on_tick = [&](std::int64_t now_ns) {
    if (off_ns == 0 && b.esc().telemetry().state == MotorState::off) off_ns = now_ns;
  };
  const std::int64_t last_ns = b.tool().now_ns();
  b.command_for(0.005, [&] { b.tool().broadcast(c, 7); });  // one more command, the last
  ASSERT_TRUE(b.tool().run_until(last_ns + 10 * kSecond_ns, [&] { return off_ns != 0; }));
  b.expect_within("bridge_off_after_raw", static_cast<double>(off_ns - last_ns) * 1e-6, 250.0);
}

TEST_P(EscOnABus, ReportsAtItsStatusRates) {
  EscBench b(GetParam());
  b.power_on();
  tools::EscTable table(b.tool());
  b.discover();
  const auto reports_in = [&](const std::function<void()>& meanwhile) {
    const std::uint64_t before = table.of_index(0) == nullptr ? 0 : table.of_index(0)->reports;
    meanwhile();
    return static_cast<double>(table.of_index(0)->reports - before);
  };
  const double idle = reports_in([&] { b.tool().run_for(3 * kSecond_ns); });
  b.rpm_for(1.0, 4000, kArmed);
  const double running = reports_in([&] { b.rpm_for(2.0, 4000, kArmed); });
  RecordProperty("idle_Hz", std::to_string(idle / 3));
  RecordProperty("running_Hz", std::to_string(running / 2));
  if (!b.judges_time()) return;
  EXPECT_NEAR(idle / 3, 2.0, 0.4);
  EXPECT_NEAR(running / 2, 50.0, 1.0);
}

INSTANTIATE_TEST_SUITE_P(Backends, EscOnABus, ::testing::ValuesIn(backends()), backend_name);

}  // namespace
}  // namespace rotorloop::live
