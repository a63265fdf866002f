// Two promises of docs/acceptance/esc_protections.md on drawn boards: a rotor that is held fast costs little current for a short time,
// and one sample that is nonsense costs nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "bench/hil/esc_lab/closed_loop.hpp"
#include "sim/esc/native_esc.hpp"

namespace rotorloop::sim {
namespace {

using esc_lab::kPeriodsPerMs;
using esc_lab::kRpm;
using esc_lab::run_ms;
using firmware::Fault;

constexpr double kLoad_N_m_s2 = 2.9e-8, kRun_ms = 900.0;

NativeEsc running_on_a_drawn_board(std::uint64_t seed, double rpm) {
  NativeEscConfig c;
  c.seed = seed;
  c.bus_V = 15.2;
  c.typical_board = true;
  NativeEsc esc(c);
  esc.drive().sensing().parameters().bad_sample_every = 0.0;  // only the one that the test makes
  esc.couple_quadratic(kLoad_N_m_s2, 15.2);
  run_ms(esc, 20.0);
  esc.set_setpoint(esc_lab::speed(rpm * kRpm));
  run_ms(esc, kRun_ms);
  return esc;
}

TEST(RotorLock, BridgeOffWithin150MillisecondsHalfTheLimitRmsOverAny5SecondsLatchedWithin5Seconds) {
  constexpr double kLimit_A = 40.0;
  double worst_rms_A = 0.0, latest_off_ms = 0.0, latest_latch_ms = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    NativeEsc esc = running_on_a_drawn_board(seed, 8000);
    ASSERT_NEAR(esc.omega_rad_s(), 8000 * kRpm, 8.0) << "seed " << seed;
    esc.drive().add_fault({.kind = DriveFaultKind::rotor_lock, .phase = 0, .from_s = esc.drive().time_s()});
    double off_ms = -1.0, latch_ms = -1.0;
    std::vector<double> square_A2;  // means of a millisecond
    double sum_A2 = 0.0;
    int n = 0;
    run_ms(esc, 7000.0, [&](double ms) {
      const auto& s = esc.drive().motor().state();
      sum_A2 += s.i_d_A * s.i_d_A + s.i_q_A * s.i_q_A;
      if (++n % kPeriodsPerMs == 0) {
        square_A2.push_back(sum_A2 / kPeriodsPerMs);
        sum_A2 = 0.0;
      }
      if (off_ms < 0.0 && !esc.board().bridge) off_ms = ms;
      if (latch_ms < 0.0 && esc.telemetry().latched) latch_ms = ms;
    });
    double window_A2 = 0.0, most_A2 = 0.0;
    for (std::size_t k = 0; k < square_A2.size(); ++k) {
      window_A2 += square_A2[k] - (k >= 5000 ? square_A2[k - 5000] : 0.0);
      most_A2 = std::max(most_A2, window_A2 / 5000.0);
    }
    ASSERT_GE(off_ms, 0.0) << "seed " << seed;
    ASSERT_GE(latch_ms, 0.0) << "seed " << seed;
    worst_rms_A = std::max(worst_rms_A, std::sqrt(most_A2));
    latest_off_ms = std::max(latest_off_ms, off_ms);
    latest_latch_ms = std::max(latest_latch_ms, latch_ms);
  }
  std::printf(
      "rotor held fast, 4 drawn boards: off within %.0f ms, %.1f A rms over the worst 5 s (current vector), latched within %.0f ms\n",
      latest_off_ms, worst_rms_A, latest_latch_ms);
  EXPECT_LE(latest_off_ms, 150.0);
  EXPECT_LE(worst_rms_A, 0.5 * kLimit_A);
  EXPECT_LE(latest_latch_ms, 5000.0);
}

TEST(RotorLock, WithoutStallDetectionCurrentFlowsForAsLongAsItIsHeldAndNobodyIsTold) {
  NativeEsc esc = running_on_a_drawn_board(1, 8000);
  esc.motor().config().protection.stall_ticks = esc.motor().config().protection.slip_ticks = 60000;
  esc.drive().add_fault({.kind = DriveFaultKind::rotor_lock, .phase = 0, .from_s = esc.drive().time_s()});
  double sum_A2 = 0.0;
  int n = 0;
  run_ms(esc, 5000.0, [&](double) {
    const auto& s = esc.drive().motor().state();
    sum_A2 += s.i_d_A * s.i_d_A + s.i_q_A * s.i_q_A;
    ++n;
  });
  std::printf("without stall detection: %.1f A rms over 5 s\n", std::sqrt(sum_A2 / n));
  EXPECT_TRUE(esc.board().bridge);
  EXPECT_EQ(esc.telemetry().fault, Fault::none);
}

// What one bad sample makes of the speed: largest deviation in percent in the 60 ms after it.
struct BadSample {
  double deviation_percent = 0.0;
  std::uint32_t trips = 0, replaced = 0;
  Fault fault = Fault::none;
};

enum class Channel { u, v, w, temperature, bus };

BadSample one_bad_sample(std::uint64_t seed, double rpm, Channel channel, bool high, bool check = true) {
  NativeEsc esc = running_on_a_drawn_board(seed, rpm);
  esc.motor().config().check.bridge = check;
  Sensing& sensing = esc.drive().sensing();
  const double before = esc.omega_rad_s(), bus_ratio = sensing.parameters().bus_ratio;
  const auto replaced = esc.motor().counters().samples_replaced;
  if (channel == Channel::bus)
    sensing.parameters().bus_ratio = high ? 1.0 : 0.0;
  else
    sensing.faults[static_cast<std::size_t>(channel)] = high ? ChannelFault::high_rail : ChannelFault::low_rail;
  esc.step_current_loop();
  sensing.parameters().bus_ratio = bus_ratio;
  sensing.faults = {};
  BadSample b;
  run_ms(esc, 60.0,
         [&](double) { b.deviation_percent = std::max(b.deviation_percent, 100.0 * std::fabs(esc.omega_rad_s() / before - 1.0)); });
  b.trips = esc.telemetry().trips;
  b.replaced = esc.motor().counters().samples_replaced - replaced;
  b.fault = esc.telemetry().fault;
  return b;
}

TEST(BadSample, OneOnAnyChannelAtEitherEndCostsAtMostHalfAPercentOfSpeedAndNoTrip) {
  double worst_percent = 0.0;
  for (const double rpm : {3000.0, 10200.0, 15000.0}) {
    for (const Channel channel : {Channel::u, Channel::v, Channel::w, Channel::temperature, Channel::bus}) {
      for (const bool high : {false, true}) {
        const BadSample b = one_bad_sample(3, rpm, channel, high);
        const std::string where = "channel " + std::to_string(static_cast<int>(channel)) + (high ? " high" : " low") + " at " +
                                  std::to_string(static_cast<int>(rpm)) + " RPM";
        EXPECT_LE(b.deviation_percent, 0.5) << where;
        EXPECT_EQ(b.trips, 0u) << where;
        EXPECT_EQ(b.fault, Fault::none) << where;
        worst_percent = std::max(worst_percent, b.deviation_percent);
      }
    }
  }
  std::printf("one bad sample on five channels, both ends, three speeds: speed off by at most %.2f %%\n", worst_percent);
}

TEST(BadSample, WithoutTheCheckOneOnACurrentChannelOpensTheBridge) {
  EXPECT_GE(one_bad_sample(3, 10200.0, Channel::u, true, false).trips, 1u);
}

}  // namespace
}  // namespace rotorloop::sim
