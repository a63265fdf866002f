// Sequences, predictions and limits, without a motor.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "bench/stand/run/paired_steps.hpp"
#include "bench/stand/run/prediction.hpp"
#include "bench/stand/run/sample_grid.hpp"
#include "host/base/error.hpp"
#include "test/unit/bench/stand/run/virtual_run.hpp"

namespace rotorloop {
namespace {

using testing::Contains;
using testing::HasSubstr;

TEST(StandPlan, EverySequenceBeginsAndEndsWithAZeroAndStaysWithinItsSpeeds) {
  stand_run::SequenceOptions o;
  o.low_rad_s = 400.0;
  o.high_rad_s = 1000.0;
  o.replay = {{0.0, 500.0}, {1.0, 900.0}, {3.0, 450.0}};
  for (const auto name : stand_run::kSequences) {
    const stand_run::Plan p = stand_run::make_plan({std::string(name)}, o);
    EXPECT_EQ(p.segments.front().motion, stand_run::Motion::zero) << name;
    EXPECT_EQ(p.segments.back().motion, stand_run::Motion::zero) << name;
    EXPECT_LE(p.highest_rad_s(), 1000.0 + 1e-9) << name;
  }
}

TEST(StandPlan, AStaircaseClimbsInEqualStepsOfTheSquareAndComesDownTheSameWay) {
  stand_run::SequenceOptions o;
  o.low_rad_s = 400.0;
  o.high_rad_s = 1000.0;
  o.levels = 4;
  const auto p = stand_run::make_plan({"staircase"}, o);
  std::vector<double> speeds;
  for (const auto& s : p.segments)
    if (s.omega_rad_s > 200.0) speeds.push_back(s.omega_rad_s);
  ASSERT_EQ(speeds.size(), 7u);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_NEAR(speeds[i] * speeds[i] - speeds[i - 1] * speeds[i - 1], (1e6 - 16e4) / 3.0, 1e-6);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(speeds[i], speeds[6 - i]);
}

TEST(StandPlan, ShuffledLevelsAreThoseOfTheStaircaseInAnOrderOfTheSeed) {
  stand_run::SequenceOptions o;
  const auto speeds = [&](const char* name, std::uint64_t seed) {
    o.seed = seed;
    std::vector<double> out;
    for (const auto& s : stand_run::make_plan({name}, o).segments) out.push_back(s.omega_rad_s);
    return out;
  };
  EXPECT_THAT(speeds("shuffled", 3), testing::UnorderedElementsAreArray(speeds("staircase", 3)));
  EXPECT_NE(speeds("shuffled", 3), speeds("shuffled", 4));
  EXPECT_EQ(speeds("shuffled", 3), speeds("shuffled", 3));
}

TEST(StandPlan, PrbsIsOfTwoSpeeds3percentApartAsOftenAboveAsBelowAndUnlikeItselfAtEveryShiftOfItsPeriod) {
  stand_run::SequenceOptions o;
  o.low_rad_s = 400.0;
  o.high_rad_s = 1000.0;
  const stand_run::Plan p = stand_run::make_plan({"prbs"}, o);
  const stand_run::Segment& s = p.segments[1];
  ASSERT_EQ(s.motion, stand_run::Motion::prbs);
  std::vector<int> chips;
  for (int k = 0; k < 511; ++k) {
    const double w = stand_run::wanted_rad_s(p, s, (k + 0.5) * s.chip_s);
    EXPECT_NEAR(std::abs(w - 700.0), 700.0 * 0.014, 1e-9);
    chips.push_back(w > 700.0 ? 1 : -1);
    EXPECT_EQ(w, stand_run::wanted_rad_s(p, s, (k + 511 + 0.5) * s.chip_s)) << "period of 511 chips";
  }
  for (int shift = 0; shift < 511; ++shift) {
    int sum = 0;
    for (int k = 0; k < 511; ++k) sum += chips[static_cast<std::size_t>(k)] * chips[static_cast<std::size_t>((k + shift) % 511)];
    EXPECT_EQ(sum, shift == 0 ? 511 : -1);
  }
}

TEST(StandPlan, AnUnknownSequenceAndAnUpsideDownRangeAreRefusedWithWhatToDo) {
  stand_run::SequenceOptions o;
  EXPECT_THROW(stand_run::make_plan({"stairs"}, o), Error);
  o.low_rad_s = 900.0;
  o.high_rad_s = 500.0;
  try {
    stand_run::make_plan({"staircase"}, o);
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("8594 to 4775 RPM is no range"));
  }
}

TEST(StandPrediction, APlanAboveTheThrustLimitSaysSoBeforeAnythingIsArmed) {
  modbus::StandSetup setup = test::virtual_setup();
  stand_run::SequenceOptions o;
  o.low_rad_s = 400.0;
  o.high_rad_s = 1400.0;
  const auto plan = stand_run::make_plan({"staircase"}, o);
  EXPECT_TRUE(stand_run::predict(setup, plan, 0.7, 16.0).exceeded.empty());
  setup.limits.at("thrust_N").max = 2.0;
  const auto p = stand_run::predict(setup, plan, 0.7, 16.0);
  ASSERT_EQ(p.exceeded.size(), 1u);
  EXPECT_THAT(p.exceeded[0], HasSubstr("thrust_N: 3.724 N of at most 2"));  // 1.9e-6 N s^2 times 1400 rad/s squared
  EXPECT_THAT(stand_run::prediction_text(setup, plan, p), HasSubstr("EXCEEDED thrust_N"));
}

TEST(LimitMonitor, TripsOnceAfterTheDebounceAndNotForAPeakShorterThanIt) {
  stand_run::LimitMonitor m({{"current_A", {10.0, 50.0, modbus::LimitAction::cut}}});
  EXPECT_FALSE(m.see("current_A", "supply", 12.0, 0));
  EXPECT_FALSE(m.see("current_A", "supply", 12.0, 49'000'000));
  EXPECT_FALSE(m.see("current_A", "supply", 9.0, 50'000'000));
  EXPECT_FALSE(m.see("current_A", "supply", 12.0, 60'000'000));
  EXPECT_TRUE(m.see("current_A", "supply", 12.0, 110'000'000));
  EXPECT_FALSE(m.see("current_A", "supply", 12.0, 120'000'000));
}

TEST(LimitMonitor, AValueThatIsNoNumberCountsAsBeyond) {
  stand_run::LimitMonitor m({{"current_A", {10.0, 0.0, modbus::LimitAction::cut}}});
  EXPECT_TRUE(m.see("current_A", "supply", std::numeric_limits<double>::quiet_NaN(), 0));
}

TEST(SampleGrid, ReadingsOfDifferentTimesComeToOneRowLinearBetweenNeighboursLessTheirLag) {
  stand_run::SampleGrid g({{0, 100}, {5, 100}, {0, 0}}, 10, 1000);
  g.add(2, 0, 7.0);
  g.add(0, 0, 1.0);
  g.add(0, 20, 3.0);
  g.add(1, 5, 10.0);
  g.add(1, 25, 30.0);
  const auto rows = g.take(100);
  ASSERT_EQ(rows.size(), 3u);  // up to 20: later times have not been passed by all
  EXPECT_EQ(rows[1].t_ns, 10);
  EXPECT_DOUBLE_EQ(rows[1].values[0], 2.0);
  EXPECT_DOUBLE_EQ(rows[1].values[1], 20.0);
  EXPECT_DOUBLE_EQ(rows[1].values[2], 7.0);
}

TEST(SampleGrid, NeighboursTooFarApartLeaveAHole) {
  stand_run::SampleGrid g({{0, 15}}, 10, 1000);
  g.add(0, 0, 1.0);
  g.add(0, 40, 2.0);
  const auto rows = g.take(100);
  ASSERT_EQ(rows.size(), 5u);
  EXPECT_TRUE(std::isnan(rows[2].values[0]));
}

TEST(PairedSteps, AZeroThatDriftsByHalfOfTheEffectLeavesTheDifferenceAlone) {
  std::vector<stand_run::PairedStep> steps;
  double t = 0.0;
  for (int i = 0; i < 4; ++i)
    for (const char c : {'A', 'B'})
      for (const double w : {0.0, 500.0, 800.0, 0.0}) {
        const double load = (c == 'A' ? 1.0 : 0.92) * 2e-6 * w * w + 0.001 * t;
        steps.push_back({c, w, t, w, load});
        t += 1.0;
      }
  const auto d = stand_run::paired_difference(steps);
  ASSERT_TRUE(d);
  EXPECT_EQ(d->pairs, 4u);
  EXPECT_NEAR(d->share, 0.08, 1e-9);
}

TEST(StandSession, AStrutThatTakes8percentIsFoundByAbabWithinOneAndAHalf) {
  auto config = test::without_errors();
  config.properties = {};
  config.seed = config.rotor.seed = 41;
  config.rotor.thrust_lost = 0.08;
  modbus::StandSetup setup = test::virtual_setup();
  config.errors = virtual_stand::drawn_errors(41, setup.calibration.full_scale);
  config.errors.sensitivity = {{{1.0, 0.0}, {0.0, 1.0}}};
  stand_run::SequenceOptions o;
  o.low_rad_s = 700.0;
  o.high_rad_s = 1100.0;
  o.zero_s = 2.0;
  o.hold_s = 1.0;
  o.repeats = 3;
  test::VirtualRun run(setup, config, {"abab"}, o, "abab");
  run.stand.run(run.session, 200.0);
  ASSERT_EQ(run.session.end(), stand_run::RunEnd::done);
  std::vector<stand_run::PairedStep> steps;
  for (const auto& s : run.session.steps()) steps.push_back({s.configuration, s.wanted_rad_s, s.t_s, s.omega_rad_s, s.thrust_N});
  const auto d = stand_run::paired_difference(steps);
  ASSERT_TRUE(d);
  EXPECT_NEAR(d->share, 0.08, 0.015);
}

}  // namespace
}  // namespace rotorloop
