// What one flight alone lacks, at one place, for a fifth of a second, by a product of two motions, or behind a noise that ran away: none of
// it may hide in the mean of all flights.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/sysid/diagnose/residual_verdict.hpp"
#include "bench/sysid/diagnose/residuals/flight_inputs.hpp"
#include "bench/sysid/diagnose/residuals/unexplained.hpp"
#include "test/unit/bench/sysid/diagnose/made_up_series.hpp"
#include "test/unit/bench/sysid/diagnose/small_quadrotor.hpp"

namespace rotorloop::diagnose {
namespace {

using namespace testing;

constexpr double kForceNoise_N = 0.02, kTorqueNoise_N_m = 5e-4;

std::vector<Channel> motion() {
  return {{"v_x", "speed forward", "m/s", wandering(1, 0.8)},
          {"rate_z", "yaw rate", "rad/s", wandering(2, 0.5)},
          {"place_x", "place in x", "m", made([](std::size_t i) { return std::sin(2e-3 * static_cast<double>(i % kPerFlight)); })},
          {"place_y", "place in y", "m", made([](std::size_t) { return 2.0; })},
          {"height", "height", "m", made([](std::size_t) { return 1.5; })}};
}

Axes noise(std::uint64_t module) {
  Axes out = quiet_axes(module);
  for (std::size_t a = 0; a < kAxes; ++a) {
    for (double& x : out[a]) x *= a < 3 ? kForceNoise_N : kTorqueNoise_N_m;
  }
  return out;
}

ResidualFindings findings(const Axes& residual, std::vector<Channel> inputs = motion()) {
  ResidualFindings out;
  out.series.samples = four_flights();
  const std::vector<Axes> expected{noise(300), noise(310), noise(320), noise(330)};
  out.unexplained = unexplained(out.series.samples, residual, expected, inputs);
  return out;
}

Diagnosis judged(const ResidualFindings& f) {
  Diagnosis d;
  judge_residuals(f, quadrotor_of_0_7_kg_and_125_mm(), d);
  return d;
}

TEST(FlightVerdict, NoiseAloneIsCleanAndSaysUpToWhichForceAndTorqueFlightByFlight) {
  const Diagnosis d = judged(findings(noise(340)));
  EXPECT_EQ(d.verdict, DiagnosisVerdict::clean);
  ASSERT_FALSE(d.remarks.empty());
  EXPECT_NE(d.remarks.front().find("flight 3 0.02 N and 0.00051 N m"), std::string::npos) << d.remarks.front();
}

TEST(FlightVerdict, AMomentOf2p5mNmWithYawRateInOneFlightOfFourIsFoundInThatFlight) {
  const auto inputs = motion();
  Axes r = noise(350);
  // As large in the mean of all four as 1.4 mN m would be, 0.3 mN m below what matters of 0.7 kg and 125 mm.
  for (std::size_t i = kPerFlight; i < 2 * kPerFlight; ++i) r[kTorqueX][i] += 2.5e-3 * inputs[1].value[i];
  const Diagnosis d = judged(findings(r));
  EXPECT_EQ(d.verdict, DiagnosisVerdict::unexplained);
  ASSERT_EQ(d.remains.size(), 1u);
  EXPECT_EQ(d.remains[0].flight, "flight 2");
  EXPECT_EQ(d.remains[0].axis, "torque x");
  EXPECT_EQ(d.remains[0].kind, RemainingKind::systematic);
  EXPECT_NEAR(d.remains[0].beyond, 2.5e-3, 0.5e-3);
}

TEST(FlightVerdict, AForceOfAFifthOfTheWeightFor0p3SecondsIsUnexplainedWithItsSizeTimeAndPlace) {
  Axes r = noise(360);
  for (std::size_t i = 2 * kPerFlight + 500; i < 2 * kPerFlight + 530; ++i) r[kForceZ][i] += 1.4;
  const ResidualFindings f = findings(r);
  EXPECT_LT(f.unexplained.axis[kForceZ].rms, 0.1) << "next to nothing of all";
  const Diagnosis d = judged(f);
  EXPECT_EQ(d.verdict, DiagnosisVerdict::unexplained);
  ASSERT_EQ(d.remains.size(), 1u);
  EXPECT_EQ(d.remains[0].kind, RemainingKind::bursts);
  const std::string& words = d.remains[0].words;
  EXPECT_NE(words.find("+1.4 N in flight 3 at 4.9 s"), std::string::npos) << words;
  EXPECT_NE(words.find("at x 0.9, y 2.0, z 1.5 m"), std::string::npos) << words;
  EXPECT_NE(words.find("1 of 1 are within 1 m"), std::string::npos) << words;
}

TEST(FlightVerdict, ABurstOf50mNForAFifthOfASecondIsNothingThatMatters) {
  Axes r = noise(370);
  for (std::size_t i = 500; i < 520; ++i) r[kForceZ][i] += 0.1;
  EXPECT_EQ(judged(findings(r)).verdict, DiagnosisVerdict::clean);
}

TEST(FlightVerdict, AForceByYawRateTimesForwardSpeedIsPredictedByTheProductAndByNoSumOfCurves) {
  auto inputs = motion();
  Axes r = noise(380);
  for (std::size_t i = 0; i < kAll; ++i) r[1][i] += 0.06 * inputs[0].value[i] * inputs[1].value[i];
  EXPECT_NE(findings(r, inputs).unexplained.kind[1], ResidualKind::systematic) << "without the products";
  for (Channel& c : products_of_motion(inputs)) inputs.push_back(std::move(c));
  EXPECT_EQ(inputs.back().id, "rate_z*v_x");
  const ResidualFindings f = findings(r, inputs);
  EXPECT_EQ(f.unexplained.kind[1], ResidualKind::systematic);
  EXPECT_GT(f.unexplained.axis[1].explainable.share, 0.8);
  EXPECT_EQ(inputs[f.unexplained.axis[1].explainable.curves.front().input].id, "rate_z*v_x");
}

TEST(FlightVerdict, ATorqueNoiseFittedTenTimesTooLargeIsNotClean) {
  ResidualFindings f;
  f.unexplained.axis[kTorqueX].rms = 2e-3;
  f.unexplained.axis[kTorqueX].rms_expected = 20e-3;
  const Diagnosis d = judged(f);
  EXPECT_EQ(d.verdict, DiagnosisVerdict::unexplained);
  ASSERT_EQ(d.remains.size(), 1u);
  EXPECT_EQ(d.remains[0].kind, RemainingKind::noise);
}

Diagnosis held_out(score::PredictedQuantity quantity, double after, double floor) {
  identify::HeldOutScores scores;
  scores.rows.push_back({.horizon_s = 0.5, .quantity = quantity, .after = after, .ratio = {}, .floor = floor, .closed = {}});
  Diagnosis d;
  judge_held_out(scores, d);
  return d;
}

TEST(FlightVerdict, AModelWhoseHeldOutAttitudeErrsFourTimesItsFloorIsNotCleanAndAtTwiceItIs) {
  const Diagnosis four = held_out(score::kPredictedAttitude, 0.04, 0.01);
  EXPECT_EQ(four.verdict, DiagnosisVerdict::unexplained);
  ASSERT_EQ(four.remains.size(), 1u);
  EXPECT_EQ(four.remains[0].axis, "attitude after 0.5 s");
  EXPECT_EQ(held_out(score::kPredictedAttitude, 0.02, 0.01).verdict, DiagnosisVerdict::clean);
}

TEST(FlightVerdict, ARateThatErrsLessThanHalfItsFloorHasANoiseThatRanAway) {
  EXPECT_EQ(held_out(score::kPredictedRates, 1.0, 16.0).verdict, DiagnosisVerdict::unexplained);
  EXPECT_EQ(held_out(score::kPredictedRates, 14.0, 16.0).verdict, DiagnosisVerdict::clean);
}

}  // namespace
}  // namespace rotorloop::diagnose
