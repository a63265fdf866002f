// Which currents through shorted windings are a whole turn of the shaft, and which are not.
#include "firmware/core/motor/turn_decoder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "host/base/random.hpp"

namespace rotorloop::firmware {
namespace {

constexpr double kBlock_s = 1.0 / TurnConfig::kBlocks_Hz;
constexpr int kPairs = 7;

// Seconds until the decoder says yes; below 0: it did not. `counts(t)`: the current's vector.
double seconds_until_yes(const std::function<Stator(double)>& counts, double seconds, const TurnConfig& c = configure_turn(kPairs)) {
  TurnState s;
  for (int k = 0; k * kBlock_s < seconds; ++k)
    if (step(c, s, counts(k * kBlock_s))) return k * kBlock_s;
  return -1.0;
}

Stator turning(double amplitude_counts, double electrical_rad) {
  return {static_cast<float>(amplitude_counts * std::cos(electrical_rad)), static_cast<float>(amplitude_counts * std::sin(electrical_rad))};
}

TEST(TurnDecoder, AShaftAt3To100RadPerSecondIsFeltAfterOneTurnAndBeforeOneAndAHalfInBothSenses) {
  for (const double speed_rad_s : {3.0, 10.0, 30.0, 60.0, 100.0}) {
    for (const double sense : {-1.0, 1.0}) {
      const double turn_s = 2.0 * std::numbers::pi / speed_rad_s;
      const double s = seconds_until_yes([&](double t) { return turning(10.0, 1.0 + sense * kPairs * speed_rad_s * t); }, 3.0 * turn_s);
      EXPECT_GE(s, turn_s) << sense * speed_rad_s;
      EXPECT_LE(s, 1.5 * turn_s + 0.2) << sense * speed_rad_s << ", with the time in which the zeros are found";
    }
  }
}

TEST(TurnDecoder, LessThanATurnIsNone) {
  for (double turns = 0.05; turns < 1.0; turns += 0.05) {
    for (double from = 0.0; from < 6.3; from += 0.3) {
      const double s = seconds_until_yes(
          [&](double t) { return turning(12.0, from + 2.0 * std::numbers::pi * kPairs * std::min(turns, 5.0 * t)); }, 2.0);
      ASSERT_LT(s, 0.0) << turns << " turns from " << from;
    }
  }
}

TEST(TurnDecoder, HalfTurnsToAndFroAreNoneHoweverMany) {
  const double s = seconds_until_yes([](double t) { return turning(12.0, std::numbers::pi * kPairs * 0.9 * std::sin(6.0 * t)); }, 30.0);
  EXPECT_LT(s, 0.0);
}

// Ten times the drift of a board that warms up, and noise of three times its size: still nothing that turns.
TEST(TurnDecoder, NoiseAndDriftingZerosAreNoneIn600Seconds) {
  const RandomStream noise(0x48414E44, 1);
  std::uint64_t k = 0;
  const double s = seconds_until_yes(
      [&](double t) {
        return Stator{static_cast<float>(1.0 * noise.gaussian(k++) + 60.0 * t), static_cast<float>(1.0 * noise.gaussian(k++) - 40.0 * t)};
      },
      600.0);
  EXPECT_LT(s, 0.0);
}

// Without hysteresis and with a quarter of an electrical turn for a whole one noise alone turns.
TEST(TurnDecoder, NoiseIsATurnWhereNeitherHysteresisNorAWholeTurnIsAskedFor) {
  TurnConfig c = configure_turn(kPairs);
  c.least_counts = 0.0f;
  c.steps = 3;
  const RandomStream noise(0x48414E44, 2);
  std::uint64_t k = 0;
  const double s = seconds_until_yes(
      [&](double) {
        return Stator{static_cast<float>(0.33 * noise.gaussian(k++)), static_cast<float>(0.33 * noise.gaussian(k++))};
      },
      10.0, c);
  EXPECT_GE(s, 0.0);
}

TEST(TurnDecoder, ACreepingShaftAndAPauseInTheTurnAreNone) {
  EXPECT_LT(seconds_until_yes([](double t) { return turning(8.0, kPairs * 0.4 * t); }, 60.0), 0.0) << "slower than anything a hand does";
  // Three quarters of a turn, a rest of half a second, three quarters of a turn.
  const auto with_a_rest = [](double t) {
    const double turns = 3.0 * (t < 0.25 ? t : t < 0.75 ? 0.25 : std::min(t - 0.5, 0.5));
    return turning(t > 0.25 && t < 0.75 ? 0.0 : 12.0, 2.0 * std::numbers::pi * kPairs * turns);
  };
  EXPECT_LT(seconds_until_yes(with_a_rest, 1.0), 0.0);
}

}  // namespace
}  // namespace rotorloop::firmware
