// Noise that lasts against noise that does not, on series whose truth is known.
#include "bench/sysid/diagnose/ranking/gust.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host/base/random.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr double kStep_s = 0.2;

std::vector<std::vector<double>> series(double sigma, double time_s, double white, std::uint64_t seed) {
  const RandomStream random(seed, 7);
  std::uint64_t sample = 0;
  std::vector<std::vector<double>> out(3);
  const double stays = std::exp(-kStep_s / time_s), drive = sigma * std::sqrt(1.0 - stays * stays);
  for (auto& y : out) {
    double a = sigma * random.gaussian(sample++);
    for (int k = 0; k < 100; ++k) {
      y.push_back(a + white * random.gaussian(sample++) + 0.5);  // beside a constant
      a = stays * a + drive * random.gaussian(sample++);
    }
  }
  return out;
}

TEST(ColouredNoise, WhiteNoiseGainsLessThan4In19Of20Series) {
  int false_alarms = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) false_alarms += coloured_noise(series(0.0, 1.0, 0.1, seed), kStep_s).gain > 4.0;
  EXPECT_LE(false_alarms, 2);
}

TEST(ColouredNoise, Of1sAsLargeAsTheWhiteOneIsFoundAndSizedWithinAThirdOn60s) {
  std::vector<double> sigma, time_s, white;
  for (std::uint64_t seed = 1; seed <= 11; ++seed) {
    const ColouredNoise n = coloured_noise(series(0.2, 1.0, 0.2, seed), kStep_s);
    EXPECT_GT(n.gain, 4.0) << "seed " << seed;
    sigma.push_back(n.sigma);
    time_s.push_back(n.time_s);
    white.push_back(n.white);
  }
  std::sort(sigma.begin(), sigma.end());
  std::sort(time_s.begin(), time_s.end());
  EXPECT_NEAR(sigma[5], 0.2, 0.06);
  std::sort(white.begin(), white.end());
  EXPECT_NEAR(time_s[5], 1.0, 0.5);
  EXPECT_NEAR(white[5], 0.2, 0.04);
}

TEST(ColouredNoise, TooFewValuesSayNothing) {
  const std::vector<std::vector<double>> few{{1.0, -1.0, 1.0}};
  EXPECT_EQ(coloured_noise(few, kStep_s).gain, 0.0);
}

}  // namespace
}  // namespace rotorloop::diagnose
