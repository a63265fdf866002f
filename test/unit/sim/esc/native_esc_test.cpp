// The native ESC as its users see it: modes, coupling to an airframe, repeatability, direction, catching.
#include <gtest/gtest.h>

#include <array>
#include <deque>
#include <vector>

#include "bench/hil/esc_lab/rpm_loop.hpp"
#include "sim/esc/lag_esc.hpp"
#include "sim/esc/noded_esc.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::sim;
using namespace rotorloop::esc_lab;
using firmware::Limiter;
using firmware::Mode;
using firmware::MotorState;

NativeEscConfig reference(std::uint64_t seed = 1) {
  NativeEscConfig c;
  c.seed = seed;
  c.bus_V = 15.2;
  return c;
}

NativeEsc running_at(double rpm, NativeEscConfig c = reference()) {
  NativeEsc esc = make_esc(c);
  esc.set_setpoint(speed(rpm * kRpm));
  run_ms(esc, 700.0);
  return esc;
}

TEST(NativeEsc, TwoRunsOfOneSeedAreBitIdenticalAndAnotherSeedIsNot) {
  const auto trace = [](std::uint64_t seed) {
    NativeEsc esc = make_esc(reference(seed));
    esc.set_setpoint(speed(5000 * kRpm));
    std::vector<double> w;
    run_ms(esc, 400.0, [&](double) { w.push_back(esc.omega_rad_s()); });
    return w;
  };
  EXPECT_EQ(trace(11), trace(11));
  EXPECT_NE(trace(11), trace(12));
}

TEST(NativeEsc, MeansSinceTheLastCouplingAgreeWithTheShaftAndThePowerBalance) {
  NativeEsc esc = running_at(9000);
  const double w0 = esc.omega_rad_s();
  esc.set_setpoint(speed(10000 * kRpm));
  esc.couple(kTriblade_N_m_s2 * w0 * w0, 15.2);
  run_ms(esc, 5.0);
  EXPECT_NEAR(esc.shaft_acceleration_rad_s2(), (esc.omega_rad_s() - w0) / 5e-3, 1e-6 * esc.shaft_acceleration_rad_s2());
  run_ms(esc, 300.0);
  esc.couple(kTriblade_N_m_s2 * std::pow(esc.omega_rad_s(), 2), 15.2);
  run_ms(esc, 100.0);
  // Steady state: bus power = shaft power + copper + friction + bridge.
  const double w = esc.omega_rad_s(), shaft_W = kTriblade_N_m_s2 * w * w * w + 2e-3 * w;
  const double i = esc.drive().motor().state().i_q_A;
  const double least_W = shaft_W + 1.5 * 0.064 * i * i;
  EXPECT_GT(esc.bus_current_A() * 15.2, least_W * 0.97);
  EXPECT_LT(esc.bus_current_A() * 15.2, least_W * 1.08);
  // … and the firmware's own estimate, made from its commands, lies near it.
  EXPECT_NEAR(static_cast<double>(esc.telemetry().bus_A), esc.bus_current_A(), 0.08 * esc.bus_current_A());
}

TEST(NativeEsc, RunsBackwardsAndReversesThroughStandstillWithoutATripOnEightBoards) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    NativeEsc esc = running_at(-4000, reference(seed));
    EXPECT_NEAR(esc.omega_rad_s(), -4000 * kRpm, 4.0);
    esc.set_setpoint(speed(4000 * kRpm));
    run_ms(esc, 1000.0);
    EXPECT_NEAR(esc.omega_rad_s(), 4000 * kRpm, 4.0);
    EXPECT_EQ(esc.motor().counters().reversals, 1u);
    EXPECT_EQ(esc.motor().counters().errors(), 0u) << "board " << seed;
  }
}

TEST(NativeEsc, CatchesATurningRotorInBothDirections) {
  for (const double share : {0.2, 0.4, 0.6, 0.95, -0.2, -0.4, -0.6, -0.95}) {
    NativeEsc esc = make_esc(reference());
    esc.drive().motor().state().omega_rad_s = share * 1780.0;
    esc.set_setpoint(speed((share > 0 ? 1.0 : -1.0) * 9000 * kRpm));
    double reached_ms = 1e9;
    run_ms(esc, 300.0, [&](double t) {
      if (reached_ms > 1e8 && std::fabs(std::fabs(esc.omega_rad_s()) - 9000 * kRpm) < 10.0) reached_ms = t;
    });
    EXPECT_LT(reached_ms, 150.0) << share;
    EXPECT_EQ(esc.motor().counters().catches, 1u) << share;
    EXPECT_EQ(esc.motor().counters().errors(), 0u) << share;
  }
}

TEST(NativeEsc, WithoutCatchingAWindmillingRotorFallsOutOfTheStart) {
  NativeEsc esc = make_esc(reference());
  esc.motor().config().finder.forward_e_rad_s = esc.motor().config().start.short_catch_speed_rad_s = 1e9f;
  esc.drive().motor().state().omega_rad_s = 0.6 * 1780.0;
  esc.set_setpoint(speed(9000 * kRpm));
  run_ms(esc, 150.0);
  EXPECT_EQ(esc.motor().counters().catches, 0u);
  EXPECT_GT(std::fabs(esc.omega_rad_s() - 9000 * kRpm), 100.0);
}

TEST(NativeEsc, CurrentModeGivesTheTorqueAskedAndDutyModeASpeedThatFallsWithTheBus) {
  NativeEsc esc = running_at(6000);
  const double w0 = esc.omega_rad_s();
  esc.set_setpoint({Mode::current, 20.0f});
  double mean_A = 0.0;
  run_ms(esc, 2.0);
  run_ms(esc, 2.0, [&](double) { mean_A += esc.drive().motor().state().i_q_A / 48.0; });
  EXPECT_NEAR(mean_A, 20.0, 1.0);
  EXPECT_GT(esc.omega_rad_s(), w0);

  NativeEsc duty = running_at(6000);
  duty.set_setpoint({Mode::duty, 0.5f});
  run_ms(duty, 600.0);
  const double at_full = duty.omega_rad_s();
  duty.couple_quadratic(kTriblade_N_m_s2, 12.8);
  run_ms(duty, 600.0);
  EXPECT_NEAR(duty.omega_rad_s() / at_full, 12.8 / 15.2, 0.03);
}

TEST(NativeEsc, SlewLimitIsKeptAndReported) {
  NativeEscConfig c = reference();
  c.firmware.speed_slew_rad_s2 = 2000.0f;
  NativeEsc esc = running_at(6000, c);
  run_ms(esc, 300.0);
  const double w0 = esc.omega_rad_s();
  esc.set_setpoint(speed(9000 * kRpm));
  run_ms(esc, 100.0);
  EXPECT_NEAR(esc.omega_rad_s() - w0, 200.0, 4.0);
  EXPECT_EQ(esc.telemetry().limiter, Limiter::speed_slew);
}

TEST(NativeEsc, SetpointsOutsideTheSpeedRangeAreMovedIntoItAndReported) {
  NativeEscConfig c = reference();
  c.bus_V = 16.8;
  NativeEsc esc = running_at(30000, c);
  run_ms(esc, 300.0);
  EXPECT_NEAR(esc.omega_rad_s(), 1780.0, 4.0);
  EXPECT_EQ(esc.telemetry().limiter, Limiter::max_speed);
  NativeEsc slow = running_at(100);
  EXPECT_NEAR(slow.omega_rad_s(), 105.0, 3.0);
  EXPECT_EQ(slow.telemetry().limiter, Limiter::min_speed);
}

TEST(NativeEsc, RecoversFromASecondAtTheVoltageLimitWithinOneSettlingTime) {
  NativeEscConfig c = reference();
  c.bus_V = 8.6;
  c.firmware.undervoltage_V = 6.0f;
  NativeEsc esc = running_at(15000, c);
  run_ms(esc, 1000.0);
  EXPECT_LT(esc.omega_rad_s(), 14800 * kRpm);
  EXPECT_EQ(esc.telemetry().limiter, Limiter::voltage);
  esc.set_setpoint(speed(8000 * kRpm));
  const double before = esc.omega_rad_s();
  double last_outside_ms = 0.0;
  run_ms(esc, 300.0, [&](double t) {
    if (std::fabs(esc.omega_rad_s() - 8000 * kRpm) > 0.02 * std::fabs(before - 8000 * kRpm)) last_outside_ms = t;
  });
  EXPECT_LT(last_outside_ms, 70.0);
}

TEST(NativeEsc, BoardPoweredWithoutABatteryNeitherStartsNorCrashes) {
  NativeEscConfig c = reference();
  c.bus_V = 0.0;
  NativeEsc esc = make_esc(c);
  esc.set_setpoint(speed(5000 * kRpm));
  run_ms(esc, 50.0);
  EXPECT_EQ(esc.telemetry().state, MotorState::off);
  EXPECT_DOUBLE_EQ(esc.bus_current_A(), 0.0);
}

TEST(NativeEsc, NotANumberRenewsNoOrderTheMotorCoastsAfter20MillisecondsAndSaysWhy) {
  NativeEsc esc = running_at(6000);
  esc.set_setpoint({Mode::speed, std::numeric_limits<float>::quiet_NaN()});
  run_ms(esc, 19.0);
  EXPECT_TRUE(esc.board().bridge);
  run_ms(esc, 2.0);
  EXPECT_FALSE(esc.board().bridge);
  EXPECT_EQ(esc.telemetry().blocked, firmware::Blocked::stale_order);
  EXPECT_GT(esc.motor().counters().setpoints_refused, 0u);
  EXPECT_EQ(esc.motor().counters().orders_expired, 1u);
}

TEST(LagEsc, Reaches63PercentAfterItsTimeConstant) {
  LagEsc esc;
  esc.set_setpoint({Mode::speed, 1000.0f});
  esc.couple(0.01, 15.0);
  for (int k = 0; k < 720; ++k) esc.step_current_loop();  // 30 ms
  EXPECT_NEAR(esc.omega_rad_s(), 632.12, 0.01);
  EXPECT_NEAR(esc.shaft_acceleration_rad_s2(), 632.12 / 0.030, 1.0);
}

// The least that a node can be: takes a set-point from a frame, answers with its speed.
struct EchoNode {
  firmware::Setpoint wanted{};
  std::deque<CanFrame> out;
  void on_frame(const CanFrame& frame, std::int64_t) { wanted = {Mode::speed, static_cast<float>(frame.data[0]) * 10.0f}; }
  void poll(std::int64_t, const firmware::Telemetry& t) {
    out.clear();
    CanFrame f;
    f.id = 2;
    f.length = 1;
    f.data[0] = static_cast<std::uint8_t>(t.speed_rad_s / 10.0f);
    out.push_back(f);
  }
  std::optional<CanFrame> next_frame() {
    if (out.empty()) return std::nullopt;
    const CanFrame f = out.front();
    out.pop_front();
    return f;
  }
  firmware::Setpoint setpoint(std::int64_t) const { return wanted; }
};

struct OneFramePort final : CanBus {
  std::optional<StampedFrame> incoming;
  std::vector<CanFrame> sent;
  SendStatus send(const CanFrame& f) override { return sent.push_back(f), SendStatus::queued; }
  std::optional<StampedFrame> receive() override { return std::exchange(incoming, std::nullopt); }
  BusState state() const override { return BusState::error_active; }
  PortCounters counters() const override { return {}; }
};

TEST(NodedEsc, CarriesASetpointFromTheBusToTheShaftAndItsSpeedBack) {
  OneFramePort port;
  NodedEsc<NativeEsc, EchoNode> esc(make_esc(reference()), EchoNode{}, port);
  CanFrame command;
  command.id = 1;
  command.length = 1;
  command.data[0] = 70;
  port.incoming = StampedFrame{command, 0};
  for (int k = 0; k < 24000; ++k) esc.step_current_loop();
  EXPECT_NEAR(esc.esc().omega_rad_s(), 700.0, 3.0);
  EXPECT_EQ(port.sent.size(), 4000u);  // 4 kHz
  EXPECT_NEAR(port.sent.back().data[0], 70, 1);
}

}  // namespace
