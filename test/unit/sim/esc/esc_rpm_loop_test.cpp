// Acceptance of the closed RPM loop; prints the table of docs/acceptance/esc_rpm_loop.md. Each limit is followed by an
// ablation that misses it, so that the test is known to be able to fail.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "bench/hil/esc_lab/rpm_loop.hpp"
#include "bench/hil/flight/limiter_names.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::sim;
using namespace rotorloop::esc_lab;

void row(const char* id, const std::string& measured, const char* limit, const std::string& ablation) {
  std::printf("| %s | %s | %s | %s |\n", id, measured.c_str(), limit, ablation.c_str());
}

template <class... T>
std::string text(const char* format, T... values) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

std::string names(const std::set<firmware::Limiter>& limiters) {
  std::string all;
  for (const auto l : limiters) all += (all.empty() ? "" : "+") + std::string(hil::limiter_name(l));
  return all.empty() ? "none" : all;
}

NativeEscConfig reference(std::uint64_t seed) {
  NativeEscConfig c;
  c.seed = seed;
  c.bus_V = 4 * 3.8;
  return c;
}

class StepTest : public testing::TestWithParam<std::pair<double, double>> {};

TEST_P(StepTest, RisesIn35msSettlesIn70msOvershootsAtMost5Percent) {
  const auto [from, to] = GetParam();
  StepResult worst;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const StepResult r = measure_step(reference(seed), from, to);
    worst.rise_ms = std::max(worst.rise_ms, r.rise_ms);
    worst.settle_ms = std::max(worst.settle_ms, r.settle_ms);
    worst.overshoot_percent = std::max(worst.overshoot_percent, r.overshoot_percent);
    worst.peak_current_A = std::max(worst.peak_current_A, r.peak_current_A);
    worst.limiters.insert(r.limiters.begin(), r.limiters.end());
  }
  const StepResult wound = measure_step(reference(1), from, to, [](NativeEsc& e) { e.motor().config().speed.hold_at_limit = false; });
  NativeEscConfig weak = reference(1);
  weak.firmware.phase_current_limit_A = 15.0f;
  const StepResult slow = measure_step(weak, from, to);
  row(text("step %.0f to %.0f RPM", from, to).c_str(),
      text("rise %.1f ms, settle %.1f ms, overshoot %.1f %%, peak i_q %.1f A, limiter %s (worst of 10 boards)", worst.rise_ms,
           worst.settle_ms, worst.overshoot_percent, worst.peak_current_A, names(worst.limiters).c_str()),
      "35 ms, 70 ms, 5 %", text("no hold at the limit: overshoot %.1f %%; 15 A: rise %.1f ms", wound.overshoot_percent, slow.rise_ms));
  EXPECT_LE(worst.rise_ms, 35.0);
  EXPECT_LE(worst.settle_ms, 70.0);
  EXPECT_LE(worst.overshoot_percent, 5.0);
  EXPECT_LE(worst.peak_current_A, 40.0);
  EXPECT_TRUE(worst.limiters.contains(firmware::Limiter::phase_current));
  EXPECT_GT(std::max(wound.overshoot_percent / 5.0, wound.settle_ms / 70.0), 1.0);
  EXPECT_GT(slow.rise_ms, 35.0);
}
INSTANTIATE_TEST_SUITE_P(BothDirections, StepTest, testing::Values(std::pair{6800.0, 10200.0}, std::pair{10200.0, 6800.0}));

TEST(RpmLoop, FollowsSmallSinesTo20HzAt9000Rpm) {
  const double f_Hz = measure_bandwidth_Hz(reference(1), 9000.0, 100.0);
  const double sluggish_Hz = measure_bandwidth_Hz(reference(1), 9000.0, 100.0, [](NativeEsc& e) {
    e.motor().config().speed.feedback_rad_s = 60.0f;
    e.motor().config().speed.reference_rad_s = 60.0f;
  });
  row("-3 dB, +-100 RPM at 9 000 RPM", text("%.0f Hz", f_Hz), ">= 20 Hz", text("loop at 60 rad/s: %.0f Hz", sluggish_Hz));
  EXPECT_GE(f_Hz, 20.0);
  EXPECT_LT(sluggish_Hz, 20.0);
}

TEST(RpmLoop, HoldsSpeedWithin02Percent) {
  SteadyResult worst;
  for (const double rpm : {1500.0, 3000.0, 6800.0, 9000.0, 10200.0, 14000.0}) {
    const SteadyResult r = measure_steady(reference(3), rpm);
    if (std::fabs(r.mean_error_percent) > std::fabs(worst.mean_error_percent)) worst.mean_error_percent = r.mean_error_percent;
    worst.rms_percent = std::max(worst.rms_percent, r.rms_percent);
  }
  NativeEscConfig wrong = reference(3);
  wrong.firmware.load_N_m_s2 = 1.5e-8f;  // half the propeller: the integral must find the rest …
  const SteadyResult learnt = measure_steady(wrong, 9000.0);
  wrong.firmware.load_N_m_s2 = 0.0f;
  const SteadyResult no_integral = measure_steady(wrong, 9000.0, [](NativeEsc& e) { e.motor().config().speed.integral_share = 0.0f; });
  row("steady error 1 500 to 14 000 RPM",
      text("mean %.3f %%, rms %.2f %%; with half the load coefficient %.3f %%", worst.mean_error_percent, worst.rms_percent,
           learnt.mean_error_percent),
      "0.2 % mean", text("no integral, no load coefficient: %.2f %%", no_integral.mean_error_percent));
  EXPECT_LE(std::fabs(worst.mean_error_percent), 0.2);
  EXPECT_LE(worst.rms_percent, 0.5);
  EXPECT_LE(std::fabs(learnt.mean_error_percent), 0.2);
  EXPECT_GT(std::fabs(no_integral.mean_error_percent), 0.2);
}

TEST(RpmLoop, KeepsSpeedWhileTheBatterySags) {
  const double deviation = measure_sag_percent(reference(4), 10200.0), open = measure_sag_percent(reference(4), 10200.0, true);
  row("4.2 to 3.5 V/cell in 1 s at 10 200 RPM", text("%.2f %%", deviation), "0.7 %", text("fixed duty: %.1f %%", open));
  EXPECT_LE(deviation, 0.7);
  EXPECT_GT(open, 0.7);
}

TEST(RpmLoop, Starts20OutOf20WithinSixHundredMilliseconds) {
  int good = 0, of_200 = 0, blind = 0;
  double slowest_ms = 0.0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const StartResult r = measure_start(seed, 2000.0);
    const bool ok = r.reached_ms <= 600.0 && r.held;
    if (seed <= 20) {
      good += ok ? 1 : 0;
      slowest_ms = std::max(slowest_ms, r.reached_ms);
      const StartResult b = measure_start(seed, 2000.0, [](NativeEsc& e) {
        auto& m = e.motor().config();
        m.resistance.least_ohm = m.resistance.most_ohm = 0.064f;  // resistance as in the parameter
        m.observer.length_least = m.observer.length_most = 1.0f;  // flux as in the parameter
        m.observer.speed_corner_rad_s = 1500.0f;                  // speed as wide as the angle
        m.start.damping_A_V = 0.0f;
      });
      blind += b.reached_ms <= 600.0 && b.held ? 1 : 0;
    }
    of_200 += ok ? 1 : 0;
  }
  row("starts to 2 000 RPM, R, L, flux +-20 %, 3.5 to 4.2 V/cell", text("%d/20, slowest %.0f ms; %d/200", good, slowest_ms, of_200),
      "20/20 in 600 ms", text("nominal parameters, rotor swing undamped: %d/20", blind));
  EXPECT_EQ(good, 20);
  EXPECT_EQ(of_200, 200);
  EXPECT_LT(blind, 20);
}

TEST(RpmLoop, ObserverHoldsAt200ThousandElectricalRpm) {
  const FastResult r = measure_fast(reference(5), 200.0);
  const FastResult late = measure_fast(reference(5), 200.0, [](NativeEsc& e) { e.motor().config().compensate_delay = false; });
  row("observer at 200 keRPM, current mode, light load",
      text("%.1f keRPM, locked, speed error mean %.3f %% worst %.2f %%, angle error worst %.3f rad", r.speed_keRPM, r.mean_error_percent,
           r.worst_error_percent, r.worst_angle_rad),
      "locked, 0.5 %, 0.1 rad", text("inverse Park without the 1.5-sample advance: %.1f keRPM", late.speed_keRPM));
  EXPECT_TRUE(r.locked);
  EXPECT_NEAR(r.speed_keRPM, 200.0, 4.0);
  EXPECT_LE(r.worst_error_percent, 0.5);
  EXPECT_LE(r.worst_angle_rad, 0.1);
  EXPECT_LT(late.speed_keRPM, 190.0);
}

TEST(RpmLoop, Reaches17000RpmLoadedAt3V5PerCell) {
  NativeEscConfig c = reference(6);
  c.bus_V = 14.0;
  const SteadyResult r = measure_steady(c, 17000.0);
  const SteadyResult strong = measure_steady(c, 17000.0, [](NativeEsc& e) { e.motor().config().weaken_A_per_V = 0.0f; });
  NativeEscConfig magnet = c;  // the flux of a motor with 1334 RPM/V
  magnet.drive.motor.flux_linkage_Wb = 5.9e-4;
  magnet.firmware.flux_linkage_Wb = 5.9e-4f;
  const SteadyResult other = measure_steady(magnet, 17000.0, [](NativeEsc& e) { e.motor().config().weaken_A_per_V = 0.0f; });
  row("17 000 RPM (119 keRPM), tri-blade, 14.0 V", text("%.2f %%, rms %.2f %%", r.mean_error_percent, r.rms_percent), "0.2 %",
      text("no field weakening: %.2f %%; flux 5.9e-4 Wb without it: %.1f %%", strong.mean_error_percent, other.mean_error_percent));
  EXPECT_LE(std::fabs(r.mean_error_percent), 0.2);
  EXPECT_LT(other.mean_error_percent, -0.2);
}

}  // namespace
