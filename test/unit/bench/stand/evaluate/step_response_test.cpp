// Lags of a speed loop that is over within two readings, from samples made up here.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/stand/evaluate/estimate/run_dynamics.hpp"
#include "host/base/random.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kReading_s = 0.01, kLow_rad_s = 867.0, kHigh_rad_s = 1018.0, kNoise_rad_s = 0.1;
constexpr int kSteps = 36, kReadings = 60;

// Steps up and down, read at 100 Hz; the speed begins to follow `delay_s` after the reading that shows the target first, in each step up
// to half a millisecond before or after that.
StandRun steps_of(double lag_s, double delay_s) {
  StandRun run;
  SampleSeries& s = run.samples;
  const RandomStream random(11, 4);
  std::uint64_t draw = 0;
  for (int step = 0; step < kSteps; ++step) {
    const double to = step % 2 == 0 ? kLow_rad_s : kHigh_rad_s, from = step % 2 == 0 ? kHigh_rad_s : kLow_rad_s;
    const double next = from, starts_s = delay_s + 1e-3 * (random.uniform(draw++) - 0.5);
    for (int i = 0; i < kReadings; ++i) {
      const auto follows = [&](double since_s) { return since_s <= 0.0 ? from : to + (from - to) * std::exp(-since_s / lag_s); };
      // A speed that changes before its target does so within the step before.
      const double ahead_s = (i - kReadings) * kReading_s - starts_s;
      const double w = ahead_s > 0.0 ? next + (to - next) * std::exp(-ahead_s / lag_s) : follows(i * kReading_s - starts_s);
      s.t_s.push_back(kReading_s * (kReadings * step + i));
      s.target_rad_s.push_back(to);
      s.omega_rad_s.push_back(w + kNoise_rad_s * random.gaussian(draw++));
    }
  }
  s.thrust_N.assign(s.t_s.size(), kNotMeasured);
  s.torque_N_m.assign(s.t_s.size(), kNotMeasured);
  return run;
}

TEST(StepResponse, LagsOf3And5And40msBehindDelaysOf0To14msAreFoundTo5percentFrom100ReadingsPerSecond) {
  for (const double lag_s : {0.0031, 0.005, 0.04})
    for (const double delay_s : {0.0, 0.0025, 0.0044, 0.006, 0.0075, 0.014}) {
      const auto d = run_dynamics(steps_of(lag_s, delay_s), {}, 2.0, 0.0, 0.0);
      ASSERT_TRUE(d && d->up && d->down) << lag_s << " " << delay_s;
      for (const auto& found : {*d->up, *d->down}) {
        EXPECT_NEAR(found.value_s / lag_s, 1.0, 0.05) << "delay " << 1e3 * delay_s << " ms, lag " << 1e3 * lag_s << " ms";
        EXPECT_NEAR(found.delay_s, delay_s, 5e-4) << "lag " << 1e3 * lag_s << " ms";
      }
    }
}

TEST(StepResponse, ASpeedThatChanges15msBeforeItsTargetAtReadingsOf10msHasNoTimeConstantAndIsNamed) {
  const auto d = run_dynamics(steps_of(0.04, -0.015), {}, 2.0, 0.0, 0.0);
  ASSERT_TRUE(d);
  EXPECT_FALSE(d->up || d->down);
  EXPECT_NE(d->no_lag.find("the speed changes before its target"), std::string::npos) << d->no_lag;
}

}  // namespace
}  // namespace rotorloop::stand
