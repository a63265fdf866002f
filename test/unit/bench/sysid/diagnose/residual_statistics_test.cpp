// What residuals are said to depend on, on series with known answers: the cause is found with its size, and noise has no cause.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "bench/sysid/diagnose/residuals/additive_fit.hpp"
#include "bench/sysid/diagnose/residuals/dependence.hpp"
#include "bench/sysid/diagnose/residuals/lag.hpp"
#include "bench/sysid/diagnose/residuals/spectrum.hpp"
#include "bench/sysid/diagnose/residuals/unexplained.hpp"
#include "test/unit/bench/sysid/diagnose/made_up_series.hpp"

namespace rotorloop::diagnose {
namespace {

using namespace testing;
using ::testing::DoubleNear;
using ::testing::ElementsAre;

std::vector<Channel> three_inputs() {
  return {{"v_x", "speed forward", "m/s", wandering(1, 0.8)},
          {"rate_z", "yaw rate", "rad/s", wandering(2, 0.5)},
          {"height", "height", "m", wandering(3, 3.0)}};
}

TEST(Blocks, CutAPieceIntoNearEqualPartsThatHoldEverySampleOnce) {
  Samples s;
  s.flights = {"a"};
  s.add(0, 0.0, 0.01, 730);
  s.add(0, 20.0, 0.01, 50);
  const auto blocks = blocks_of(s, 1.5);
  std::size_t next = 0;
  for (const SampleBlock& b : blocks) {
    EXPECT_EQ(b.first, next);
    next += b.count;
  }
  EXPECT_EQ(next, s.size);
  EXPECT_EQ(blocks.size(), 6u) << "7.3 s make five blocks, 0.5 s one of its own";
}

TEST(Spectrum, OfASineOf0p2NAt3HzHasItsRmsOf0p141NInTheBandOf2To5HzAndNoneElsewhere) {
  Axes r{};
  for (auto& a : r) a.assign(kAll, 0.0);
  r[0] = made([](std::size_t i) { return 0.2 * std::sin(2.0 * std::numbers::pi * 3.0 * kStep_s * static_cast<double>(i)); });
  r[1].assign(kAll, 0.5);
  const Spectra s = spectra(four_flights(), r, {}, {});
  ASSERT_EQ(s.axis[0].bands.size(), 6u);
  EXPECT_NEAR(s.axis[0].bands[2].rms, 0.2 / std::sqrt(2.0), 0.002);
  EXPECT_LT(s.axis[0].bands[0].rms + s.axis[0].bands[4].rms, 0.004) << "leaked by the window";
  EXPECT_NEAR(s.axis[1].bands[0].rms, 0.5, 1e-6) << "a constant is power in the lowest band";
}

TEST(Spectrum, OfWhiteNoiseHasItsVarianceOverAllBandsAndTheLevelOfItsLike) {
  const Axes noise = quiet_axes(20), like = quiet_axes(40);
  const Spectra s = spectra(four_flights(), noise, std::span(&like, 1), {});
  double variance = 0.0;
  for (const SpectrumBand& b : s.axis[2].bands) {
    variance += b.rms * b.rms;
    EXPECT_NEAR(b.rms / b.rms_expected, 1.0, 0.15) << b.from_Hz << " Hz";
  }
  EXPECT_NEAR(variance, 1.0, 0.05);
}

TEST(Coherence, IsFoundWithTheInputThatDrivesAndWithNoOther) {
  const auto inputs = three_inputs();
  Axes r = quiet_axes(60, 0.5);
  for (std::size_t i = 0; i < kAll; ++i) r[5][i] += inputs[1].value[i];
  const Spectra s = spectra(four_flights(), r, {}, inputs);
  ASSERT_FALSE(s.axis[5].coherence.empty());
  for (const InputCoherence& c : s.axis[5].coherence) EXPECT_EQ(inputs[c.input].id, "rate_z");
  EXPECT_GT(s.axis[5].coherence[0].coherence, 0.7);
  for (std::size_t a = 0; a < 5; ++a) EXPECT_TRUE(s.axis[a].coherence.empty()) << kAxisNames[a];
}

TEST(Dependence, OnSpeedSquaredIsRankedFirstWithItsShareAndTheBinsLieOnTheCurve) {
  const auto inputs = three_inputs();
  Axes r = quiet_axes(80);
  for (std::size_t i = 0; i < kAll; ++i) r[2][i] += 0.7 * (inputs[0].value[i] * inputs[0].value[i] - 1.0);
  const Axes expected = quiet_axes(90);
  const DependenceResult d = dependence(four_flights(), r, std::span(&expected, 1), inputs);
  const Dependence& first = d.ranking.front();
  EXPECT_EQ(inputs[first.input].id, "v_x");
  EXPECT_EQ(first.axis, 2u);
  // 0.7 (x² - 1) of a normal x has half of the power, and ten equally filled bins hold about 0.7 of that; the flights' own speeds
  // scatter about it.
  EXPECT_NEAR(first.share, 0.33, 0.08);
  int outside = 0;
  for (const DependenceBin& b : first.bins) {
    double truth = 0.0, n = 0.0;
    for (const double x : inputs[0].value) {
      if (x >= b.from && x < b.to) {
        truth += 0.7 * (x * x - 1.0);
        n += 1.0;
      }
    }
    outside += truth / n < b.low || truth / n > b.high;
  }
  EXPECT_LE(outside, 2) << "of ten bands of 95 %";
}

TEST(Dependence, OfNoiseOnAnythingIsNone) {
  const auto inputs = three_inputs();
  const DependenceResult d = dependence(four_flights(), quiet_axes(100), {}, inputs);
  ASSERT_FALSE(d.ranking.empty());
  for (const Dependence& x : d.ranking) EXPECT_LT(x.share, 0.01);
}

TEST(Dependence, OfAGustThatWandersByItselfIsNoneOnFlightsThatDidNotMakeIt) {
  const auto inputs = three_inputs();
  Axes r = quiet_axes(110);
  r[0] = wandering(120, 0.7);
  const DependenceResult d = dependence(four_flights(), r, {}, inputs);
  ASSERT_FALSE(d.ranking.empty());
  for (const Dependence& x : d.ranking) EXPECT_LT(x.share, 0.04) << inputs[x.input].name;
}

TEST(AdditiveFit, PredictsASumOfTwoCurvesToItsShareOfThePower) {
  const auto inputs = three_inputs();
  const std::vector<double> noise = white(130);
  const auto y = made([&](std::size_t i) { return std::sin(2.0 * inputs[0].value[i]) + 0.5 * inputs[1].value[i] + noise[i]; });
  const std::vector<double>* list[] = {&y, &noise};
  const auto fits = additive_fit(four_flights(), list, inputs, 1);
  const double power = mean_square(y);
  EXPECT_NEAR(fits[0].share, 1.0 - 1.0 / power, 0.03);
  EXPECT_LT(fits[1].share, 0.01) << "noise";
  ASSERT_EQ(fits[0].curves.size(), 3u);
  const PartialCurve& c = fits[0].curves[0];
  EXPECT_EQ(inputs[c.input].id, "v_x");
  for (std::size_t i = 0; i < c.at.size(); ++i) {
    if (std::fabs(c.at[i]) > 1.5) continue;
    EXPECT_NEAR(c.value[i], std::sin(2.0 * c.at[i]), 0.15) << "at " << c.at[i];
  }
  EXPECT_LT(fits[0].curves[2].share, 0.01) << "height has no part";
  EXPECT_GT(fits[0].curves[0].alone, 0.15);
}

// Signals of a second and faster, as torques are.
Axes driving() {
  Axes a;
  for (std::size_t i = 0; i < kAxes; ++i) a[i] = wandering(140 + i, 0.15);
  return a;
}
std::vector<double> moved(const std::vector<double>& v, int samples) {  // later by so many samples
  return made([&](std::size_t i) {
    const auto j = static_cast<long>(i) - samples, first = static_cast<long>(i - i % kPerFlight);
    return v[static_cast<std::size_t>(std::clamp(j, first, first + static_cast<long>(kPerFlight) - 1))];
  });
}

TEST(Lag, OfYawAloneThatLeadsItsTorqueBy40msNamesTheReactionOfTheRotors) {
  const Axes model = driving(), noise = quiet_axes(150, 0.4);
  Axes missing = noise;
  const std::vector<double> early = moved(model[5], -4);
  for (std::size_t i = 0; i < kAll; ++i) missing[5][i] += early[i] - model[5][i];
  const LagResult r = lag_analysis(four_flights(), model, missing);
  EXPECT_TRUE(r.axis[5].known);
  EXPECT_NEAR(r.axis[5].lag_s, -0.040, 0.002);
  EXPECT_LE(r.axis[5].low_s, -0.039);
  EXPECT_GE(r.axis[5].high_s, -0.041);
  ASSERT_EQ(r.findings.size(), 1u);
  EXPECT_EQ(r.findings[0].verdict, LagVerdict::leads);
  EXPECT_THAT(r.findings[0].effects, ElementsAre("rotor_inertia_reaction"));
  EXPECT_NE(r.findings[0].words.find("before its cause"), std::string::npos);
}

TEST(Lag, OfAllAxesThatLeadBy20msNamesTheClockOfTheRotorSpeeds) {
  const Axes model = driving();
  Axes missing = quiet_axes(160, 0.2);
  for (std::size_t a = 0; a < kAxes; ++a) {
    const std::vector<double> early = moved(model[a], -2);
    for (std::size_t i = 0; i < kAll; ++i) missing[a][i] += early[i] - model[a][i];
  }
  const LagResult r = lag_analysis(four_flights(), model, missing);
  ASSERT_EQ(r.findings.size(), 1u);
  EXPECT_EQ(r.findings[0].axes.size(), kAxes);
  EXPECT_NEAR(r.findings[0].lag_s, -0.020, 0.001);
  EXPECT_EQ(r.findings[0].effects.front(), "rotor_speed_delay");
}

TEST(Lag, IsNoFindingWhenTheModelDrivesInTimeNorWhenItDrivesNothing) {
  const Axes model = driving();
  EXPECT_TRUE(lag_analysis(four_flights(), model, quiet_axes(170, 0.4)).findings.empty());
  Axes still{};
  for (auto& a : still) a.assign(kAll, 1.0);
  const LagResult r = lag_analysis(four_flights(), still, quiet_axes(180));
  EXPECT_TRUE(r.findings.empty());
  EXPECT_FALSE(r.axis[0].known);
}

TEST(Bursts, OfHalfASecondAreFoundWithStartLengthAndSize) {
  std::vector<double> r = white(190, 0.1);
  for (std::size_t i = 2000 + 700; i < 2000 + 750; ++i) r[i] += 0.8;  // second flight, 7.0 to 7.5 s
  const auto found = bursts(four_flights(), r, 3, 0.2, 3.0);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].flight, 1u);
  EXPECT_NEAR(found[0].from_s, 7.0, 0.1);
  EXPECT_NEAR(found[0].to_s, 7.5, 0.1);
  EXPECT_NEAR(found[0].mean, 0.8, 0.25);
}

TEST(Unexplained, DistinguishesWhatIsPredictableFromBurstsFromGustsAndFromNoiseOfTheExpectedSize) {
  const auto inputs = three_inputs();
  Axes r = quiet_axes(200);
  std::vector<Axes> expected{quiet_axes(210), quiet_axes(220), quiet_axes(230)};
  for (std::size_t i = 0; i < kAll; ++i) r[0][i] += inputs[0].value[i];
  for (std::size_t i = 3000; i < 3080; ++i) r[1][i] += 12.0;
  const std::vector<double> gust = wandering(240, 0.4);
  for (std::size_t i = 0; i < kAll; ++i) r[2][i] += gust[i];
  const UnexplainedResult u = unexplained(four_flights(), r, expected, inputs);
  EXPECT_EQ(u.kind[0], ResidualKind::systematic);
  EXPECT_NEAR(u.axis[0].explainable.share, 0.5, 0.07);
  EXPECT_EQ(u.kind[1], ResidualKind::bursts);
  EXPECT_EQ(u.kind[2], ResidualKind::stochastic);
  for (std::size_t a = 3; a < kAxes; ++a) EXPECT_EQ(u.kind[a], ResidualKind::none) << kAxisNames[a];
}

}  // namespace
}  // namespace rotorloop::diagnose
