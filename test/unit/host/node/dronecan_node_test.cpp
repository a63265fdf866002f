// The host node against the firmware's own node: four ESCs on a small bus.
#include "host/node/dronecan_node.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "firmware/core/node/esc_node.hpp"
#include "test/unit/host/node/small_bus.hpp"

namespace rotorloop::host {
namespace {

using firmware::EscNode;
using firmware::Mode;
namespace fast = protocols::fast;

class HostAndFourEscs : public ::testing::Test {
 protected:
  struct Esc {
    SmallBus::Port* port;
    EscNode node;
    firmware::Telemetry telemetry;
    bool powered = true;
  };

  HostAndFourEscs() : host_port_(bus_.add_port()), host_(host_port_, {}) {
    for (std::uint8_t i = 0; i < 4; ++i) {
      firmware::Parameters p;
      p.bidirectional = true;
      p.node_id = static_cast<std::uint8_t>(40 + i);
      p.esc_index = i;
      firmware::NodeIdentity identity;
      identity.unique_id[0] = i;
      escs_.push_back({.port = &bus_.add_port(), .node = EscNode(p, identity), .telemetry = {}, .powered = true});
      escs_.back().telemetry.bus_V = 16.0f;
      escs_.back().telemetry.temperature_K = 300.0f + static_cast<float>(i);
      escs_.back().telemetry.speed_valid = true;
    }
  }

  // Steps of 100 µs: ESCs poll each step, the host each millisecond; `each_ms` runs before the host's poll.
  template <class F>
  void run_ms(int ms, F&& each_ms) {
    for (int k = 0; k < 10 * ms; ++k) {
      now_us_ += 100;
      bus_.run_until(now_us_);
      for (Esc& e : escs_) {
        const auto t = static_cast<std::uint64_t>(now_us_);
        while (const auto f = e.port->receive()) {
          if (e.powered) e.node.on_frame(f->frame, t);
        }
        if (!e.powered) continue;
        // A motor that follows at once.
        const firmware::Setpoint s = e.node.setpoint(t);
        e.telemetry.speed_rad_s = s.mode == Mode::speed ? s.value : s.mode == Mode::duty ? 2000.0f * s.value : 0.0f;
        e.telemetry.state = s.mode == Mode::off ? firmware::MotorState::off : firmware::MotorState::running;
        e.node.poll(t, e.telemetry);
        while (const auto f = e.node.next_frame()) e.port->send(*f);
      }
      if (k % 10 == 9) {
        each_ms();
        host_.poll(now_us_);
      }
    }
  }
  void run_ms(int ms) {
    run_ms(ms, [] {});
  }
  Mode mode(int i) const { return escs_[static_cast<std::size_t>(i)].node.setpoint(static_cast<std::uint64_t>(now_us_)).mode; }
  float value(int i) const { return escs_[static_cast<std::size_t>(i)].node.setpoint(static_cast<std::uint64_t>(now_us_)).value; }

  SmallBus bus_;
  SmallBus::Port& host_port_;
  DroneCanNode host_;
  std::vector<Esc> escs_;
  std::int64_t now_us_ = 0;
};

TEST_F(HostAndFourEscs, FindsAllNodesAndTheirIdentity) {
  run_ms(1500);
  ASSERT_EQ(host_.nodes().size(), 4u);
  for (std::uint8_t i = 0; i < 4; ++i) {
    const NodeRecord* n = host_.node(static_cast<std::uint8_t>(40 + i));
    ASSERT_NE(n, nullptr);
    EXPECT_TRUE(n->online);
    EXPECT_TRUE(n->info_known);
    EXPECT_EQ(n->status.mode, protocols::NodeMode::operational);
    EXPECT_EQ(n->info.unique_id[0], i);
    EXPECT_EQ(std::string(n->info.name.data(), n->info.name_length), "org.rotorloop.esc");
  }
  EXPECT_EQ(host_.node(77), nullptr);
}

TEST_F(HostAndFourEscs, SilentNodeIsOfflineAfter3sAndComesBackAsRestarted) {
  run_ms(5100);  // last NodeStatus at 5.0 s
  escs_[1].powered = false;
  run_ms(2800);
  EXPECT_TRUE(host_.node(41)->online);
  run_ms(300);
  EXPECT_FALSE(host_.node(41)->online);
  EXPECT_TRUE(host_.node(40)->online);
  firmware::Parameters p;
  p.node_id = 41;
  p.esc_index = 1;
  escs_[1].node = EscNode(p, {});
  escs_[1].powered = true;
  run_ms(2500);
  EXPECT_TRUE(host_.node(41)->online);
  EXPECT_EQ(host_.node(41)->restarts, 1u);
  EXPECT_TRUE(host_.node(41)->info_known) << "asked again";
  EXPECT_EQ(host_.nodes().size(), 4u);
}

TEST_F(HostAndFourEscs, LostIdentityRequestIsRepeated) {
  int lost = 0;
  bus_.lose = [&](const CanFrame& f) {
    const auto id = protocols::decode_id(f.id);
    return f.extended && id.kind == protocols::TransferKind::request && ++lost <= 5;
  };
  run_ms(4500);
  EXPECT_GT(lost, 5);
  for (const NodeRecord& n : host_.nodes()) EXPECT_TRUE(n.info_known);
}

TEST_F(HostAndFourEscs, ArmingIsAnnouncedTwicePerSecondAndAtOnceOnChange) {
  const auto count = [&] {
    return std::count_if(bus_.seen.begin(), bus_.seen.end(),
                         [](const CanFrame& f) { return f.extended && protocols::decode_id(f.id).data_type_id == 1100; });
  };
  run_ms(2000);
  EXPECT_EQ(count(), 4);
  EXPECT_FALSE(escs_[0].node.armed());
  host_.set_armed(true);
  run_ms(3);
  EXPECT_TRUE(escs_[3].node.armed());
  host_.set_armed(false);
  run_ms(3);
  EXPECT_FALSE(escs_[3].node.armed());
}

TEST_F(HostAndFourEscs, RawAndRpmCommandsReachEachEsc) {
  host_.set_armed(true);
  run_ms(5);
  const std::array<float, 4> duty{0.1f, 0.2f, -0.3f, std::numeric_limits<float>::quiet_NaN()};
  EXPECT_TRUE(host_.send_raw(duty));
  run_ms(5);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(mode(i), Mode::duty);
    EXPECT_NEAR(value(i), duty[static_cast<std::size_t>(i)], 1e-4f);
  }
  EXPECT_EQ(mode(3), Mode::off) << "NaN is a stop";
  const std::array<float, 4> speed{937.2f, 500.0f, 1000.0f, -900.0f};
  EXPECT_TRUE(host_.send_rpm(speed));
  run_ms(5);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(mode(i), Mode::speed);
    EXPECT_NEAR(value(i), speed[static_cast<std::size_t>(i)], 0.06f);
  }
}

TEST_F(HostAndFourEscs, EscStatusArrivesPerIndexInSiUnits) {
  host_.set_armed(true);
  run_ms(5);
  const std::array<float, 4> speed{400.0f, 500.0f, 600.0f, -700.0f};
  run_ms(200, [&] { host_.send_rpm(speed); });
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(host_.esc(i));
    EXPECT_EQ(host_.esc(i)->node_id, 40 + i);
    EXPECT_NEAR(static_cast<float>(host_.esc(i)->status.rpm), speed[static_cast<std::size_t>(i)] * 9.5493f, 1.0f);
    EXPECT_NEAR(host_.esc(i)->status.temperature_K, 300.0f + static_cast<float>(i), 0.2f);
  }
  EXPECT_FALSE(host_.esc(9));
}

TEST_F(HostAndFourEscs, FastLoopAt1kHzLosesNothingAndAnswersWithinTheMillisecond) {
  host_.set_armed(true);
  run_ms(5);
  const std::array<float, 4> speed{937.0f, 938.0f, 939.0f, 940.0f};
  run_ms(2000, [&] { EXPECT_TRUE(host_.send_fast(0, fast::SetpointMode::rpm, speed, now_us_)); });
  for (int i = 0; i < 4; ++i) {
    const EscFeedback& e = host_.group(0).esc(i);
    EXPECT_GE(e.received, 1998u);
    EXPECT_EQ(e.lost, 0u);
    EXPECT_EQ(e.unexpected, 0u);
    EXPECT_GT(e.round_trip_us, 0);
    EXPECT_LE(e.worst_round_trip_us, 1000);
    EXPECT_NEAR(e.last.speed_rad_s(), speed[static_cast<std::size_t>(i)], 0.2f);
    EXPECT_LE(e.age_us(now_us_), 1100);
  }
  EXPECT_EQ(host_.counters().rejected_tx, 0u);
}

TEST_F(HostAndFourEscs, FastLossesAreCountedOnBothSides) {
  host_.set_armed(true);
  run_ms(5);
  int n = 0;
  bus_.lose = [&](const CanFrame& f) { return fast::is_setpoint_id(f) && ++n % 10 == 0; };
  const std::array<float, 4> speed{500.0f, 500.0f, 500.0f, 500.0f};
  run_ms(1000, [&] { host_.send_fast(0, fast::SetpointMode::rpm, speed, now_us_); });
  EXPECT_NEAR(static_cast<double>(host_.group(0).esc(2).lost), 100.0, 2.0);
  EXPECT_NEAR(static_cast<double>(escs_[2].node.command_counters().fast_lost), 100.0, 2.0);
  EXPECT_EQ(mode(2), Mode::speed) << "single losses do not stop a motor";
}

TEST_F(HostAndFourEscs, HostThatStopsSendingStopsAllMotors) {
  host_.set_armed(true);
  run_ms(5);
  const std::array<float, 4> speed{500.0f, 500.0f, 500.0f, 500.0f};
  run_ms(100, [&] { host_.send_fast(0, fast::SetpointMode::rpm, speed, now_us_); });
  EXPECT_EQ(mode(0), Mode::speed);
  run_ms(25);  // NodeStatus and ArmingStatus of the host go on
  for (int i = 0; i < 4; ++i) EXPECT_EQ(mode(i), Mode::off);
  EXPECT_GT(host_.group(0).esc(0).age_us(now_us_), 20'000);
}

TEST_F(HostAndFourEscs, FullTransmitQueueIsCountedAndPeriodicMessagesStayDue) {
  host_port_.capacity = 0;
  run_ms(100);
  EXPECT_GT(host_.counters().rejected_tx, 0u);
  const std::array<float, 4> duty{};
  EXPECT_FALSE(host_.send_raw(duty));
  host_port_.capacity = 64;
  run_ms(3);
  EXPECT_TRUE(std::any_of(bus_.seen.begin(), bus_.seen.end(), [](const CanFrame& f) { return f.extended && (f.id & 127u) == 120u; }));
}

TEST_F(HostAndFourEscs, AnotherNodeWithOurIdIsNoticed) {
  SmallBus::Port& duplicate = bus_.add_port();
  protocols::NodeStatus s;
  std::array<std::uint8_t, 7> payload{};
  encode(s, payload);
  protocols::encode_transfer({.kind = protocols::TransferKind::message, .priority = 20, .data_type_id = 341, .source = 120}, 0, 0, payload,
                             [&](const CanFrame& f) {
                               duplicate.send(f);
                               return true;
                             });
  run_ms(5);
  EXPECT_EQ(host_.counters().id_conflict, 1u);
}

TEST_F(HostAndFourEscs, TableIsBoundedAndOfflineNodesGiveWay) {
  SmallBus::Port& crowd = bus_.add_port();
  crowd.capacity = 1000;
  protocols::TransferIdCounter id;
  const auto announce = [&](std::uint8_t first, std::uint8_t last) {
    const std::uint8_t transfer_id = id.next();
    for (std::uint8_t node = first; node <= last; ++node) {
      std::array<std::uint8_t, 7> payload{};
      encode(protocols::NodeStatus{}, payload);
      protocols::encode_transfer({.kind = protocols::TransferKind::message, .priority = 20, .data_type_id = 341, .source = node}, 0,
                                 transfer_id, payload, [&](const CanFrame& f) { return crowd.send(f) == SendStatus::queued; });
    }
  };
  run_ms(100);
  announce(60, 72);  // 4 + 13 > 16
  run_ms(100);
  EXPECT_EQ(host_.nodes().size(), DroneCanNode::kMaxNodes);
  EXPECT_EQ(host_.counters().too_many_nodes, 1u);
  run_ms(3200);
  announce(90, 90);
  run_ms(100);
  ASSERT_NE(host_.node(90), nullptr);
  EXPECT_TRUE(host_.node(90)->online);
  EXPECT_TRUE(host_.node(40)->online) << "a living node keeps its place";
}

}  // namespace
}  // namespace rotorloop::host
