// What stands between an ESC's node and its motor control: wrong scale, noise and delay, and nothing of it by default.
#include "sim/esc/noded_esc.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sim/esc/lag_esc.hpp"

namespace rotorloop::sim {
namespace {

// Commands a speed, writes down what it is told, and sends one frame a poll, numbered.
struct RecordingNode {
  std::vector<float> received_rad_s;
  std::uint32_t sent = 0;
  bool pending = false;
  void on_frame(const CanFrame&, std::int64_t) {}
  void poll(std::int64_t, const firmware::Telemetry& t) {
    received_rad_s.push_back(t.speed_rad_s);
    pending = true;
  }
  std::optional<CanFrame> next_frame() {
    if (!pending) return std::nullopt;
    pending = false;
    CanFrame f;
    f.id = ++sent;
    return f;
  }
  firmware::Setpoint setpoint(std::int64_t) { return {firmware::Mode::speed, 900.0f}; }
};

struct CollectingPort final : CanBus {
  std::vector<std::uint32_t> ids;
  std::size_t waiting = 0;  // frames to be received
  SendStatus send(const CanFrame& frame) override {
    ids.push_back(frame.id);
    return SendStatus::queued;
  }
  std::optional<StampedFrame> receive() override { return waiting > 0 ? (--waiting, std::optional(StampedFrame{})) : std::nullopt; }
  BusState state() const override { return BusState::error_active; }
  PortCounters counters() const override { return {}; }
};

struct Bench {
  CollectingPort port;
  NodedEsc<LagEsc, RecordingNode> esc;
  explicit Bench(const EscSetup& setup, std::uint64_t seed = 1) : esc(LagEsc({.time_constant_s = 0.005}), {}, port, setup, {seed, 9}) {}
  void run(double seconds) {
    for (int i = 0; i < static_cast<int>(24000 * seconds); ++i) esc.step_current_loop();
  }
};

TEST(NodedEsc, WithoutDefectsHoldsAndReportsTheCommandAndSendsAtOnce) {
  Bench b({});
  b.run(0.2);
  EXPECT_NEAR(b.esc.esc().omega_rad_s(), 900.0, 1e-3);
  EXPECT_NEAR(static_cast<double>(b.esc.node().received_rad_s.back()), 900.0, 1e-3);
  EXPECT_EQ(b.port.ids.size(), b.esc.node().sent);
}
TEST(NodedEsc, AFloodOutOfABufferLeavesTheLoopItsPollsAndSetPointsAndIsTakenAtEightFramesEach) {
  Bench b({});
  b.port.waiting = 100'000;
  b.run(0.2);
  EXPECT_NEAR(b.esc.esc().omega_rad_s(), 900.0, 1e-3) << "the set-point came through from the first poll on";
  EXPECT_EQ(b.esc.node().received_rad_s.size(), 800u) << "a poll every 250 us";
  EXPECT_EQ(b.port.waiting, 100'000u - 800u * 8u);
}
TEST(NodedEsc, WithASpeedScaleOf3PercentReportsTheCommandWhileTheRotorTurns3PercentSlower) {
  Bench b({.speed_scale = 1.03});
  b.run(0.2);
  EXPECT_NEAR(b.esc.esc().omega_rad_s(), 900.0 / 1.03, 1e-3);
  EXPECT_NEAR(static_cast<double>(b.esc.node().received_rad_s.back()), 900.0, 1e-2);
}
TEST(NodedEsc, SpeedNoiseScattersTheReportsByItsSigmaAndLeavesTheRotor) {
  Bench b({.speed_noise_rad_s = 15.0});
  b.run(2.0);
  const auto& told = b.esc.node().received_rad_s;
  double squares = 0.0;
  int n = 0;
  for (std::size_t i = told.size() / 2; i < told.size(); ++i, ++n) squares += std::pow(static_cast<double>(told[i]) - 900.0, 2);
  EXPECT_NEAR(std::sqrt(squares / n), 15.0, 0.6) << n << " reports";
  EXPECT_NEAR(b.esc.esc().omega_rad_s(), 900.0, 1e-3);
  Bench again({.speed_noise_rad_s = 15.0}), other({.speed_noise_rad_s = 15.0}, 2);
  again.run(0.1);
  other.run(0.1);
  EXPECT_EQ(again.esc.node().received_rad_s[300], told[300]);
  EXPECT_NE(other.esc.node().received_rad_s[300], told[300]);
}
TEST(NodedEsc, AReportDelayOf8MillisecondsHoldsAllFramesBackInOrder) {
  Bench b({.report_delay_ns = 8'000'000});
  b.run(0.0075);
  EXPECT_TRUE(b.port.ids.empty());
  b.run(0.0925);
  ASSERT_FALSE(b.port.ids.empty());
  EXPECT_NEAR(static_cast<double>(b.esc.node().sent - b.port.ids.size()), 0.008 * 4000, 1.0) << "32 polls are under way";
  for (std::size_t i = 0; i < b.port.ids.size(); ++i) EXPECT_EQ(b.port.ids[i], i + 1);
}

}  // namespace
}  // namespace rotorloop::sim
