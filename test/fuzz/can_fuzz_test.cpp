// Random and malformed frames against everything that reads frames: the ESC's node, the host's node, the state receiver.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "firmware/core/node/esc_node.hpp"
#include "host/base/random.hpp"
#include "host/node/dronecan_node.hpp"
#include "protocols/state_receiver.hpp"

namespace rotorloop {
namespace {

using protocols::TransferKind;

constexpr std::uint64_t kFrames = 300'000;

// Frames from pure noise to almost right.
class NoiseSource {
 public:
  explicit NoiseSource(std::uint64_t seed) : random_(seed, 0xF022) {}

  std::uint64_t next(std::uint64_t below) { return random_.bits(n_++) % below; }

  CanFrame frame() {
    if (!pending_.empty()) {
      const std::size_t i = next(4) == 0 ? next(pending_.size()) : 0;  // now and then out of order
      CanFrame f = pending_[i];
      if (next(16) != 0) pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(i));  // now and then twice
      if (next(24) == 0) f.data[next(8)] = static_cast<std::uint8_t>(next(256));
      return f;
    }
    switch (next(5)) {
      case 0:
        return noise();
      case 1:
        return standard();
      default:
        transfer();
        return frame();
    }
  }

 private:
  CanFrame noise() {
    CanFrame f;
    f.extended = next(2) == 0;
    f.id = static_cast<std::uint32_t>(next(f.extended ? 1u << 29 : 1u << 11));
    f.length = static_cast<std::uint8_t>(next(9));
    for (std::uint8_t& b : f.data) b = static_cast<std::uint8_t>(next(256));
    return f;
  }
  CanFrame standard() {
    static constexpr std::uint32_t kBases[] = {
        protocols::fast::kSetpointBase, protocols::fast::kFeedbackBase,        protocols::state::kGyroId,
        protocols::state::kPoseStampId, protocols::state::kSetpointPositionId, protocols::state::kStatusId};
    CanFrame f = noise();
    f.extended = false;
    f.id = kBases[next(6)] + static_cast<std::uint32_t>(next(16));
    if (next(4) != 0) f.length = static_cast<std::uint8_t>((f.id & 0x7F0u) == protocols::fast::kFeedbackBase ? 4 + 2 * next(2) : 8);
    return f;
  }
  void transfer() {
    static constexpr protocols::DataType kTypes[] = {protocols::NodeStatus::kType, protocols::GetNodeInfo::kType,
                                                     protocols::RawCommand::kType, protocols::RpmCommand::kType,
                                                     protocols::EscStatus::kType,  protocols::ArmingStatus::kType};
    const protocols::DataType& type = kTypes[next(6)];
    protocols::FrameId id{.kind = TransferKind::message, .priority = static_cast<std::uint8_t>(next(32)), .data_type_id = type.id};
    if (type.service) id.kind = next(2) == 0 ? TransferKind::request : TransferKind::response;
    id.source = static_cast<std::uint8_t>(next(8) == 0 ? next(128) : 100 + next(4));
    id.destination = type.service ? static_cast<std::uint8_t>(next(2) == 0 ? 42 : next(128)) : std::uint8_t{0};
    std::array<std::uint8_t, 420> payload{};
    const std::size_t size = next(8) == 0 ? next(payload.size()) : next(48);
    for (std::size_t i = 0; i < size; ++i) payload[i] = static_cast<std::uint8_t>(next(256));
    const auto seed = static_cast<std::uint16_t>(next(8) == 0 ? next(65536) : type.crc_seed());
    protocols::encode_transfer(id, seed, static_cast<std::uint8_t>(next(32)), std::span<const std::uint8_t>(payload.data(), size),
                               [&](const CanFrame& f) {
                                 pending_.push_back(f);
                                 return true;
                               });
  }
  RandomStream random_;
  std::uint64_t n_ = 0;
  std::vector<CanFrame> pending_;
};

firmware::Parameters parameters() {
  firmware::Parameters p;
  p.node_id = 42;
  p.esc_index = 2;
  return p;
}

// The one frame that may arm, left out of the noise.
bool could_arm(const CanFrame& f) {
  return f.extended && protocols::decode_id(f.id).data_type_id == protocols::ArmingStatus::kType.id && f.length == 2 && f.data[0] == 255;
}

std::uint32_t sum(const protocols::ReceiverCounters& c) {
  return c.transfers + c.not_subscribed + c.anonymous + c.bad_frame + c.bad_address + c.bad_start + c.missed_start + c.wrong_toggle +
         c.wrong_transfer_id + c.duplicate + c.wrong_crc + c.too_long + c.no_session;
}

TEST(CanFuzz, NoiseNeverArmsTheEscAndItsQueueStaysBounded) {
  NoiseSource noise(1);
  firmware::EscNode node(parameters(), {});
  std::uint64_t now_us = 0;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    const CanFrame f = noise.frame();
    if (could_arm(f)) continue;
    // A frame with its own id silences the node for 3 s: in the first half it gets to speak.
    if (i < kFrames / 2 && f.extended && (f.id & 127u) == 42u) continue;
    now_us += noise.next(300);
    node.on_frame(f, now_us);
    ASSERT_FALSE(node.armed()) << "frame " << i;
    ASSERT_EQ(node.setpoint(now_us).mode, firmware::Mode::off);
    if (noise.next(4) == 0) node.poll(now_us, {});
    if (noise.next(64) == 0) node.next_frame();  // a congested bus
  }
  // The noise did reach the parts that matter.
  const firmware::CommandCounters& c = node.command_counters();
  EXPECT_GT(c.raw_commands, 100u);
  EXPECT_GT(c.rpm_commands, 100u);
  EXPECT_GT(c.fast_setpoints, 100u);
  EXPECT_GT(c.not_armed, 300u);
  EXPECT_GT(node.counters().id_conflicts, 100u);
  EXPECT_GT(node.counters().tx_overflow + node.counters().tx_expired, 0u);
  const protocols::ReceiverCounters& r = node.receiver_counters();
  for (const std::uint32_t counter :
       {r.transfers, r.anonymous, r.bad_frame, r.bad_start, r.missed_start, r.wrong_toggle, r.wrong_transfer_id, r.duplicate, r.aborted,
        r.wrong_crc, r.too_long, r.displaced, r.not_subscribed}) {
    EXPECT_GT(counter, 0u);
  }
}

TEST(CanFuzz, ArmedEscObeysOnlyInsideItsLimitsAndStopsWhenNoOrderForItComes) {
  NoiseSource noise(2);
  firmware::Parameters p = parameters();
  p.require_arming = false;
  firmware::EscNode node(p, {});
  std::uint64_t now_us = 0, last_orders_us = 0;
  std::uint32_t orders = 0;
  std::uint64_t spinning = 0, stopped = 0;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    now_us += noise.next(3) == 0 ? noise.next(3000) : noise.next(100);
    if (i % 5000 == 0) {  // long gaps too
      now_us += 300'000;
      ASSERT_EQ(node.setpoint(now_us).mode, firmware::Mode::off) << "frame " << i;
    }
    node.on_frame(noise.frame(), now_us);
    if (i % 50 == 0) {  // the autopilot's keep-alive: arms, but is no order
      const CanFrame arm{.id = protocols::encode_id({.kind = TransferKind::message, .priority = 24, .data_type_id = 1100, .source = 5}),
                         .extended = true,
                         .length = 2,
                         .data = {255, static_cast<std::uint8_t>(0xC0u | (i / 50) % 32)}};
      node.on_frame(arm, now_us);
    }
    node.poll(now_us, {});
    while (node.next_frame()) {
    }
    const firmware::CommandCounters& c = node.command_counters();
    if (c.raw_commands + c.rpm_commands + c.fast_setpoints != orders) {
      orders = c.raw_commands + c.rpm_commands + c.fast_setpoints;
      last_orders_us = now_us;
    }
    const firmware::Setpoint s = node.setpoint(now_us);
    if (s.mode == firmware::Mode::off) {
      ++stopped;
      continue;
    }
    ++spinning;
    ASSERT_LE(now_us - last_orders_us, 250'000u) << "spinning without a fresh order, frame " << i;
    const float limit = s.mode == firmware::Mode::duty    ? 1.0f
                        : s.mode == firmware::Mode::speed ? p.max_speed_rad_s
                                                          : p.phase_current_limit_A;
    ASSERT_LE(std::fabs(s.value), limit);
    if (s.mode == firmware::Mode::speed) {
      ASSERT_GE(std::fabs(s.value), p.min_speed_rad_s);
    }
  }
  EXPECT_GT(spinning, 1000u);
  EXPECT_GT(stopped, 1000u);
}

TEST(CanFuzz, ReceiverAccountsForEveryFrameExactlyOnce) {
  static constexpr std::array<protocols::Subscription, 2> kSubscriptions{
      protocols::subscribe(TransferKind::message, protocols::RawCommand::kType),
      protocols::subscribe(TransferKind::request, protocols::GetNodeInfo::kType)};
  NoiseSource noise(3);
  protocols::Receiver<4, 45> receiver(42, kSubscriptions);
  std::uint64_t now_us = 0;
  std::uint64_t silent = 0;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    const CanFrame f = noise.frame();
    now_us += noise.next(2000);
    const std::uint32_t before = sum(receiver.counters());
    const auto t = receiver.accept(f, now_us);
    const std::uint32_t counted = sum(receiver.counters()) - before;
    ASSERT_LE(counted, 1u);
    if (t) {
      ASSERT_LE(t->payload.size(), 45u);
    }
    // Uncounted frames are 11-bit ones and those that carried a transfer on.
    if (counted == 0 && f.extended) {
      ++silent;
      ASSERT_EQ(f.length, 8);
    }
  }
  EXPECT_GT(silent, 100u);
}

class NoisyBus final : public CanBus {
 public:
  explicit NoisyBus(std::uint64_t seed) : noise_(seed) {}
  SendStatus send(const CanFrame&) override { return noise_.next(4) == 0 ? SendStatus::queue_full : SendStatus::queued; }
  std::optional<StampedFrame> receive() override {
    if (noise_.next(8) == 0) return std::nullopt;
    time_ns += static_cast<std::int64_t>(noise_.next(200'000));
    return StampedFrame{.frame = noise_.frame(), .time_ns = time_ns};
  }
  BusState state() const override { return BusState::error_active; }
  PortCounters counters() const override { return {}; }
  std::int64_t time_ns = 0;

 private:
  NoiseSource noise_;
};

TEST(CanFuzz, HostNodeKeepsItsTablesBounded) {
  NoisyBus bus(4);
  host::DroneCanNode node(bus, {.node_id = 42});
  for (int i = 0; i < 60'000; ++i) {
    node.poll(bus.time_ns / 1000);
    ASSERT_LE(node.nodes().size(), host::DroneCanNode::kMaxNodes);
    if (i % 8 == 0) node.send_fast(0, protocols::fast::SetpointMode::rpm, {1, 2, 3, 4}, bus.time_ns / 1000);
  }
  EXPECT_GT(node.receiver_counters().transfers, 1000u);
  EXPECT_GT(node.group(0).esc(0).received, 100u);
}

TEST(CanFuzz, StateReceiverDeliversOnlyFiniteAndNormalisedSamples) {
  NoiseSource noise(5);
  protocols::state::StateReceiver receiver;
  std::int64_t now_us = 0;
  std::uint64_t delivered = 0;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    CanFrame f = noise.frame();
    if (noise.next(2) == 0) {  // mostly one sequence number, so that samples do get complete
      f.extended = false;
      f.length = 8;
      f.id = protocols::state::kPoseStampId + static_cast<std::uint32_t>(noise.next(4));
      f.data[7] = static_cast<std::uint8_t>((f.data[7] & 0x0Fu) | (i / 64 % 16) << 4);
      if (f.id == protocols::state::kPosePositionId) f.data[6] = protocols::state::kVersion;
    }
    now_us += static_cast<std::int64_t>(noise.next(200));
    const auto e = receiver.on_frame(f, now_us);
    if (!e.pose) continue;
    ++delivered;
    double norm2 = 0.0;
    for (const double c : e.pose->q_WS) norm2 += c * c;
    ASSERT_NEAR(norm2, 1.0, 1e-12);
    for (const double p : e.pose->p_W_m) ASSERT_LE(std::fabs(p), 419.5);
  }
  EXPECT_GT(delivered, 100u);
}

}  // namespace
}  // namespace rotorloop
