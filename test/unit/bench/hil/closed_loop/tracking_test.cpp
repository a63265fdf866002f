#include "bench/hil/closed_loop/tracking.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "host/base/random.hpp"

namespace rotorloop::closed_loop {
namespace {

using ::testing::HasSubstr;

hil::FlightResult flown(const std::string& name, std::uint64_t seed, double error_cm, hil::FlightEnd end = hil::FlightEnd::completed) {
  hil::FlightResult f;
  f.flight = name;
  f.seed = seed;
  f.end = end;
  f.tracking.truth.mean_3d_cm = error_cm;
  f.tracking.truth.mean_z_cm = error_cm / 10;
  return f;
}
hil::RunResult run_of(std::vector<hil::FlightResult> flights) {
  hil::RunResult r;
  r.flights = std::move(flights);
  return r;
}
JudgedFlight judged(Expectation expect, double percent, hil::ErrorAxis axis = hil::ErrorAxis::norm_3d) {
  JudgedFlight j;
  j.flight.name = "fast";
  j.axis = axis;
  j.expect = expect;
  j.percent = percent;
  return j;
}

TEST(PairedReduction, IsTheFallOfTheMeanInPercent) {
  const std::vector before{4.0, 6.0}, after{2.0, 3.0};
  const auto r = paired_reduction(before, after);
  EXPECT_DOUBLE_EQ(r.percent, 50.0);
  EXPECT_DOUBLE_EQ(r.low, 50.0) << "both pairs fell by half: no scatter";
  EXPECT_DOUBLE_EQ(r.high, 50.0);
}

TEST(PairedReduction, PairingTakesTheScatterOfTheSeedsOut) {
  // Errors scatter by 30 % from seed to seed, but each falls by 0.2 cm.
  const std::vector before{2.0, 3.0, 4.0, 2.5, 3.5, 3.0}, after{1.8, 2.8, 3.8, 2.3, 3.3, 2.8};
  const auto r = paired_reduction(before, after);
  EXPECT_GT(r.low, 4.0);
  EXPECT_LT(r.high, 10.0);
}

TEST(PairedReduction, OneOrNoPairHasNoInterval) {
  EXPECT_TRUE(std::isnan(paired_reduction(std::vector{1.0}, std::vector{0.5}).low));
  EXPECT_TRUE(std::isnan(paired_reduction({}, {}).percent));
}

// The promise of a 95 % interval: the true reduction lies in it, also with few pairs (300 experiments: 93 % is 1.6 of their
// standard deviations below 95 %).
TEST(PairedReduction, CoversTheTruthIn93PercentOrMoreWithFourToTenPairs) {
  for (const std::size_t n : {4u, 6u, 10u}) {
    const RandomStream random(n, 7);
    std::uint64_t k = 0;
    int covered = 0;
    constexpr int kExperiments = 300;
    for (int e = 0; e < kExperiments; ++e) {
      std::vector<double> before(n), after(n);
      for (std::size_t i = 0; i < n; ++i) {
        before[i] = 3.0 + 0.3 * random.gaussian(k++);
        after[i] = 0.8 * before[i] + 0.2 * random.gaussian(k++);
      }
      const auto r = paired_reduction(before, after);
      covered += r.low <= 20.0 && 20.0 <= r.high ? 1 : 0;
    }
    EXPECT_GE(covered, kExperiments * 93 / 100) << n << " pairs";
  }
}

TEST(CompareTracking, BetterMeansThatTheWholeIntervalLiesAboveTheLimit) {
  const auto before = run_of({flown("fast", 1, 4.0), flown("fast", 2, 5.0), flown("fast", 3, 6.0)});
  const auto after = run_of({flown("fast", 1, 3.0), flown("fast", 2, 3.8), flown("fast", 3, 4.4)});
  EXPECT_TRUE(compare_tracking({judged(Expectation::better, 15)}, before, nullptr, after).at(0).pass);
  EXPECT_FALSE(compare_tracking({judged(Expectation::better, 25)}, before, nullptr, after).at(0).pass);
}

TEST(CompareTracking, NoWorseAllowsWhatThePlanAllowsAndNoMore) {
  const auto before = run_of({flown("fast", 1, 4.0), flown("fast", 2, 5.0), flown("fast", 3, 6.0)});
  const auto after = run_of({flown("fast", 1, 4.1), flown("fast", 2, 5.1), flown("fast", 3, 6.2)});
  EXPECT_TRUE(compare_tracking({judged(Expectation::no_worse, 5)}, before, nullptr, after).at(0).pass);
  EXPECT_FALSE(compare_tracking({judged(Expectation::no_worse, 1)}, before, nullptr, after).at(0).pass);
}

TEST(CompareTracking, AFlightThatIsLostAfterwardsFailsHoweverGoodTheOthersAre) {
  const auto before = run_of({flown("fast", 1, 4.0), flown("fast", 2, 5.0), flown("fast", 3, 6.0)});
  const auto after = run_of({flown("fast", 1, 1.0), flown("fast", 2, 1.0), flown("fast", 3, 0.1, hil::FlightEnd::crashed)});
  const auto t = compare_tracking({judged(Expectation::better, 0)}, before, nullptr, after).at(0);
  EXPECT_FALSE(t.pass);
  EXPECT_THAT(t.reason, HasSubstr("lost"));
}

TEST(CompareTracking, PairsBySeedWhateverTheOrderAndTakesTheAxisOfThePlan) {
  const auto before = run_of({flown("fast", 1, 4.0), flown("fast", 2, 8.0)});
  const auto after = run_of({flown("fast", 2, 4.0), flown("fast", 1, 2.0)});
  const auto t = compare_tracking({judged(Expectation::better, 0, hil::ErrorAxis::z)}, before, nullptr, after).at(0);
  EXPECT_EQ(t.before, (std::vector{0.4, 0.8}));
  EXPECT_EQ(t.after, (std::vector{0.2, 0.4}));
}

}  // namespace
}  // namespace rotorloop::closed_loop
