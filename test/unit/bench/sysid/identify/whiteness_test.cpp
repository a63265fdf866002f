// The statistics that judge residuals, on series whose nature is known: the level in white noise, the power in coloured noise.
#include "bench/sysid/identify/whiteness.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/base/random.hpp"

namespace rotorloop::identify {
namespace {

// First-order coloured noise of unit variance; correlation 0: white.
std::vector<double> noise(std::uint64_t seed, std::size_t n, double correlation) {
  const RandomStream random(seed, 77);
  std::vector<double> out(n);
  double x = random.gaussian(n);
  for (std::size_t i = 0; i < n; ++i) {
    out[i] = x;
    x = correlation * x + std::sqrt(1.0 - correlation * correlation) * random.gaussian(i);
  }
  return out;
}

// Share of 1000 series that a test rejects at 5 %.
template <class Test>
double rejected(double correlation, std::size_t n, Test&& test) {
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 1000; ++seed) count += test(noise(seed, n, correlation)) < 0.05;
  return count / 1000.0;
}

TEST(Autocorrelation, OfFirstOrderNoiseFallsGeometrically) {
  const auto r = autocorrelation(noise(7, 200000, 0.8), 5);
  for (std::size_t k = 0; k <= 5; ++k) EXPECT_NEAR(r[k], std::pow(0.8, static_cast<double>(k)), 0.02) << "lag " << k;
}

TEST(Autocorrelation, PairsNothingAcrossAGap) {
  std::vector<double> s = noise(3, 20000, 0.0);
  for (std::size_t i = 5000; i < 9000; ++i) s[i] = NAN;
  const auto r = autocorrelation(s, 3);
  EXPECT_DOUBLE_EQ(r[0], 1.0);
  for (std::size_t k = 1; k <= 3; ++k) EXPECT_NEAR(r[k], 0.0, 0.025);
}

TEST(LjungBox, RejectsFivePercentOfWhiteSeries) {
  // Binomial over 1000 series: 5 % within 1.4 % at two standard deviations.
  EXPECT_NEAR(rejected(0.0, 2000, [](const auto& s) { return ljung_box(s, 20).p; }), 0.05, 0.02);
  EXPECT_NEAR(rejected(0.0, 2000, [](const auto& s) { return ljung_box(s, 100).p; }), 0.05, 0.025);
}

TEST(LjungBox, SeesACorrelationOf0p15InTwoThousandSamples) {
  // Noncentrality n r² = 45 on 20 degrees of freedom: power 0.99.
  EXPECT_GT(rejected(0.15, 2000, [](const auto& s) { return ljung_box(s, 20).p; }), 0.95);
}

TEST(RunsTest, RejectsFivePercentOfWhiteSeriesAndSeesColour) {
  EXPECT_NEAR(rejected(0.0, 2000, [](const auto& s) { return runs_test(s).p; }), 0.05, 0.02);
  EXPECT_GT(rejected(0.15, 2000, [](const auto& s) { return runs_test(s).p; }), 0.95);
  EXPECT_LT(runs_test(noise(1, 2000, 0.5)).z, -5.0) << "neighbours alike: too few runs";
}

std::vector<estimate::Innovation> innovations(std::uint64_t seed, double coloured_channel) {
  std::vector<estimate::Innovation> out(4000);
  for (std::size_t c = 0; c < 6; ++c) {
    const auto s = noise(10 * seed + c, out.size(), c == 2 ? coloured_channel : 0.0);
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i].t_s = 0.005 * static_cast<double>(i);
      out[i].value[static_cast<Eigen::Index>(c)] = s[i];
    }
  }
  return out;
}

TEST(FlightWhiteness, NamesTheOneChannelThatIsNotWhite) {
  const auto w = whiteness_of("f", innovations(1, 0.2));
  EXPECT_FALSE(w.white());
  ASSERT_EQ(w.channels.size(), 6u);
  for (std::size_t c = 0; c < 6; ++c) EXPECT_EQ(w.channels[c].white, c != 2) << w.channels[c].channel;
}

TEST(FlightWhiteness, CallsAtMostThreeOfAHundredWhiteFlightsNotWhite) {
  int wrong = 0;  // level 1 % for a flight: 4 or more of 100 have a chance of 2 %
  for (std::uint64_t seed = 1; seed <= 100; ++seed) wrong += !whiteness_of("f", innovations(seed, 0.0)).white();
  EXPECT_LE(wrong, 3);
}

TEST(FlightWhiteness, GivesTheMeanSquareOfEachSecond) {
  auto in = innovations(1, 0.0);
  for (auto& i : in) {
    if (i.t_s >= 10.0 && i.t_s < 11.0) i.value *= 3.0;
  }
  const auto w = whiteness_of("f", in);
  for (std::size_t k = 0; k < w.second_s.size(); ++k) {
    if (w.second_s[k] == 10.0) {
      EXPECT_NEAR(w.cost_per_number[k], 9.0, 1.2);
    } else {
      EXPECT_NEAR(w.cost_per_number[k], 1.0, 0.2);
    }
  }
}

}  // namespace
}  // namespace rotorloop::identify
