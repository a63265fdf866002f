// Filters and spike removal against what they promise in closed form.
#include "bench/sysid/score/preprocess.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "host/base/error.hpp"

namespace rotorloop::score {
namespace {

constexpr double kRate_Hz = 100.0;

std::vector<double> sine(double f_Hz, std::size_t n = 1000) {
  std::vector<double> x(n);
  for (std::size_t k = 0; k < n; ++k) x[k] = std::sin(2.0 * std::numbers::pi * f_Hz * static_cast<double>(k) / kRate_Hz);
  return x;
}

// In-phase and quadrature amplitude of y at f, away from the ends.
std::pair<double, double> response(const std::vector<double>& y, double f_Hz) {
  double in = 0.0, quadrature = 0.0;
  const std::size_t from = 200, to = 800;  // whole periods of any multiple of 1/6 Hz
  for (std::size_t k = from; k < to; ++k) {
    const double phase = 2.0 * std::numbers::pi * f_Hz * static_cast<double>(k) / kRate_Hz;
    in += y[k] * std::sin(phase) * 2.0 / static_cast<double>(to - from);
    quadrature += y[k] * std::cos(phase) * 2.0 / static_cast<double>(to - from);
  }
  return {in, quadrature};
}

TEST(ZeroPhaseLowPass, AmplitudeIsThatOfTheButterworthFilterSquaredAndPhaseIsZero) {
  const double cutoff_Hz = 18.0;
  for (const double f : {2.0, 6.0, 12.0, 18.0, 24.0, 36.0}) {
    const double w = std::tan(std::numbers::pi * f / kRate_Hz) / std::tan(std::numbers::pi * cutoff_Hz / kRate_Hz);
    const auto [in, quadrature] = response(zero_phase_low_pass(sine(f), cutoff_Hz, kRate_Hz), f);
    EXPECT_NEAR(in, 1.0 / (1.0 + std::pow(w, 8.0)), 1e-6) << f << " Hz";
    EXPECT_NEAR(quadrature, 0.0, 1e-6) << f << " Hz";
  }
}

TEST(ZeroPhaseLowPass, HalfTheAmplitudeAtTheCutOffForAnyEvenOrder) {
  for (const int order : {2, 4, 6}) EXPECT_NEAR(response(zero_phase_low_pass(sine(10.0), 10.0, kRate_Hz, order), 10.0).first, 0.5, 1e-6);
}

TEST(ZeroPhaseLowPass, AStraightLinePassesUnchangedUpToItsEnds) {
  std::vector<double> x;
  for (int k = 0; k < 200; ++k) x.push_back(3.0 - 0.25 * k);
  const auto y = zero_phase_low_pass(x, 10.0, kRate_Hz);
  for (std::size_t k = 0; k < x.size(); ++k) EXPECT_NEAR(y[k], x[k], 0.02) << k;
  for (std::size_t k = 50; k < 150; ++k) EXPECT_NEAR(y[k], x[k], 1e-6) << k;
}

TEST(ZeroPhaseLowPass, FewerSamplesThanThePaddingStillPass) {
  EXPECT_EQ(zero_phase_low_pass(std::vector<double>{7.0}, 10.0, kRate_Hz), std::vector<double>{7.0});
  const auto y = zero_phase_low_pass(std::vector<double>{2.0, 2.0, 2.0}, 10.0, kRate_Hz);
  for (const double v : y) EXPECT_NEAR(v, 2.0, 1e-12);
}

TEST(ZeroPhaseLowPass, RefusesACutOffBeyondHalfTheRateAndAnOddOrder) {
  const auto x = sine(1.0);
  EXPECT_THROW(zero_phase_low_pass(x, 50.0, kRate_Hz), Error);
  EXPECT_THROW(zero_phase_low_pass(x, 0.0, kRate_Hz), Error);
  EXPECT_THROW(zero_phase_low_pass(x, 10.0, kRate_Hz, 3), Error);
}

TEST(BridgeSpikes, ReplacesMissingImpossibleAndJumpingSamplesByStraightLines) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> x{100, 110, nan, 130, 140, 9000, 160, 170, 700, 190};
  EXPECT_EQ(bridge_spikes(x, 5000.0, 200.0), 3u);
  for (std::size_t k = 0; k < x.size(); ++k) EXPECT_NEAR(x[k], 100.0 + 10.0 * static_cast<double>(k), 1e-12) << k;
}

TEST(BridgeSpikes, MissingEndsTakeTheNearestGoodSample) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> x{nan, nan, 5.0, 6.0, nan};
  EXPECT_EQ(bridge_spikes(x, 100.0, 50.0), 3u);
  EXPECT_EQ(x, (std::vector<double>{5.0, 5.0, 5.0, 6.0, 6.0}));
}

TEST(BridgeSpikes, AJumpThatLastsIsTakenForReal) {
  std::vector<double> x(100, 0.0);
  std::fill(x.begin() + 50, x.end(), 1000.0);
  EXPECT_EQ(bridge_spikes(x, 5000.0, 200.0, 5), 5u);
  EXPECT_EQ(x.back(), 1000.0);
  EXPECT_EQ(x[60], 1000.0);
}

TEST(BridgeSpikes, LeavesASignalAloneThatHasNoGoodSample) {
  std::vector<double> x(4, std::numeric_limits<double>::infinity());
  EXPECT_EQ(bridge_spikes(x, 100.0, 50.0), 0u);
}

}  // namespace
}  // namespace rotorloop::score
