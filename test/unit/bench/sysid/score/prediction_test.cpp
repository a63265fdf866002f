// Scores of predictions: what each predictor may look at, the error norms, sums and intervals, on flights whose answers are known.
#include "bench/sysid/score/prediction.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "bench/sysid/score/multi_step_fit.hpp"
#include "bench/sysid/score/prediction_terms.hpp"
#include "host/base/error.hpp"
#include "host/base/random.hpp"

namespace rotorloop::score {
namespace {

host::VehicleModel small_vehicle() {
  host::VehicleModel m;
  m.mass_kg = 0.045;
  m.inertia_kg_m2 = {3.2e-5, 3.5e-5, 4.9e-5};
  const double l = 0.0353;
  m.rotors = {{{{l, -l, 0}, -1}, {{-l, l, 0}, -1}, {{l, l, 0}, 1}, {{-l, -l, 0}, 1}}};
  m.thrust = {5.5e-8, -6.8e-6, 0.0275, 1.2};
  m.c_q_N_m_s2 = 2.2e-10;
  m.drag = {0.038, 0.0, 0.0};
  return m;
}

// Rotor speeds about hover that wiggle every axis; `noise` of white measurement noise on top.
log::FlightRecord speeds(double seconds, double noise_rad_s = 0.0, std::uint64_t seed = 1) {
  log::FlightRecord r;
  const RandomStream random(seed, 1);
  std::uint64_t draw = 0;
  for (int k = 0; k <= static_cast<int>(100.0 * seconds); ++k) {
    const double t = 0.01 * k, hover = 1720.0 + 60.0 * std::sin(1.3 * t);
    const double roll = 12.0 * std::sin(9.0 * t), pitch = 11.0 * std::sin(11.0 * t + 1.0), yaw = 60.0 * std::sin(3.0 * t);
    log::RotorValues w{hover - roll - pitch - yaw, hover + roll + pitch - yaw, hover + roll - pitch + yaw, hover - roll + pitch + yaw};
    for (double& v : w) v += noise_rad_s * random.gaussian(draw++);
    r.rotor_omega_rad_s.add(t, w);
  }
  return r;
}

// The flight that the model itself makes of these speeds.
StateTrack flown(const estimate::ModelValues& values, const log::FlightRecord& true_speeds, const log::FlightRecord& logged_speeds,
                 std::size_t steps) {
  const estimate::Model model(values);
  const estimate::RotorInput input(true_speeds);
  StateTrack track{"flown", 0.0, 0.01, {estimate::BodyState{}}, estimate::RotorInput(logged_speeds)};
  track.state[0].v_W_m_s = {0.4, -0.3, 0.1};
  std::size_t hint = 0;
  for (std::size_t k = 0; k < steps; ++k)
    track.state.push_back(model.step(track.state.back(), input, hint, track.time_s(k), track.time_s(k + 1), 1));
  return track;
}
StateTrack flown(const estimate::ModelValues& values, std::size_t steps = 300) { return flown(values, speeds(4.0), speeds(4.0), steps); }

PredictionErrors errors_of(const StateTrack& track, const Predictor& predictor, std::size_t horizon = 50) {
  const auto starts = prediction_starts(track, horizon);
  return predict(track, predictor, starts, horizon);
}

TEST(Prediction, TheModelThatMadeAFlightPredictsItToRoundOff) {
  const estimate::ModelValues v = estimate::model_values(small_vehicle());
  const PredictionErrors e = errors_of(flown(v), whole_model(v));
  const PredictionSummary s = summary({&e, 1});
  for (const double sum : s.sim_error) EXPECT_LT(sum, 1e-9);
}

TEST(Prediction, StateHeldErrsByTheMotionItself) {
  const StateTrack track = flown(estimate::model_values(small_vehicle()));
  const PredictionErrors e = errors_of(track, state_held());
  for (const std::size_t h : {1u, 17u, 50u}) {
    const estimate::BodyState &a = track.state[40], &b = track.state[40 + h];
    EXPECT_DOUBLE_EQ(e.at(kPredictedPosition, 40, h), (b.p_W_m - a.p_W_m).norm());
    EXPECT_DOUBLE_EQ(e.at(kPredictedVelocity, 40, h), (b.v_W_m_s - a.v_W_m_s).norm());
    EXPECT_NEAR(e.at(kPredictedAttitude, 40, h), a.q_WB.angularDistance(b.q_WB), 1e-12);
    EXPECT_DOUBLE_EQ(e.at(kPredictedRates, 40, h), (b.w_B_rad_s - a.w_B_rad_s).norm());
  }
}

TEST(Prediction, RatesHeldIsExactForABodyThatSpinsWithoutTorque) {
  estimate::ModelValues v = estimate::model_values(small_vehicle());
  log::FlightRecord even;
  for (int k = 0; k <= 200; ++k) even.rotor_omega_rad_s.add(0.01 * k, {1700, 1700, 1700, 1700});
  StateTrack track{"spin", 0.0, 0.01, {estimate::BodyState{}}, estimate::RotorInput(even)};
  track.state[0].w_B_rad_s = {0.0, 0.0, 3.0};
  track.state[0].v_W_m_s = {1.0, 0.5, 0.2};
  const estimate::Model model(v);
  std::size_t hint = 0;
  for (std::size_t k = 0; k < 150; ++k)
    track.state.push_back(model.step(track.state.back(), track.input, hint, track.time_s(k), track.time_s(k + 1), 1));
  const PredictionErrors e = errors_of(track, rates_held(v));
  const PredictionSummary s = summary({&e, 1});
  EXPECT_LT(s.mean[kPredictedPosition].back(), 1e-8);
  EXPECT_LT(s.mean[kPredictedVelocity].back(), 1e-7);
  EXPECT_LT(s.mean[kPredictedAttitude].back(), 1e-12);
  EXPECT_LT(s.mean[kPredictedRates].back(), 1e-12);
}

TEST(Prediction, NothingAfterTheStartIsLookedAtButRotorSpeeds) {
  const estimate::ModelValues v = estimate::model_values(small_vehicle());
  StateTrack track = flown(v);
  for (const Predictor& predictor : {state_held(), rates_held(v), whole_model(v)}) {
    std::vector<estimate::BodyState> before(50), after(50);
    predictor(track, 100, before);
    StateTrack other = track;
    for (std::size_t k = 0; k < other.state.size(); ++k) {
      if (k != 100) other.state[k] = estimate::BodyState{};
    }
    predictor(other, 100, after);
    for (std::size_t k = 0; k < 50; ++k) EXPECT_EQ(estimate::difference(before[k], after[k]).norm(), 0.0);
  }
}

TEST(Prediction, TheAttitudeErrorIsTheAngleBetweenTheAttitudesWhateverTheQuaternionsSign) {
  StateTrack track = flown(estimate::model_values(small_vehicle()), 20);
  const Eigen::Vector3d turn(0.1, -0.2, 0.05);
  const auto turned = [&](const StateTrack& t, std::size_t start, std::span<estimate::BodyState> out) {
    for (std::size_t k = 0; k < out.size(); ++k) {
      out[k] = t.state[start + k + 1];
      out[k].q_WB = out[k].q_WB * estimate::exp_q(turn);
      if (k % 2 == 0) out[k].q_WB.coeffs() = -out[k].q_WB.coeffs();
    }
  };
  const PredictionErrors e = errors_of(track, turned, 4);
  for (const double a : e.error[kPredictedAttitude]) EXPECT_NEAR(a, turn.norm(), 1e-12);
}

PredictionErrors constant(std::size_t starts, std::size_t horizon, double error) {
  PredictionErrors e{"made", 0.01, horizon, {}, {}};
  for (std::size_t k = 0; k < starts; ++k) e.starts.push_back(k);
  for (auto& x : e.error) x.assign(starts * horizon, error);
  return e;
}

TEST(PredictionSummaryOfFlights, EachStartCountsOnceAndSumsRunOverAllHorizons) {
  const std::vector<PredictionErrors> flights{constant(100, 10, 1.0), constant(300, 10, 2.0)};
  const PredictionSummary s = summary(flights);
  EXPECT_EQ(s.starts, 400u);
  for (const double m : s.mean[kPredictedVelocity]) EXPECT_DOUBLE_EQ(m, 1.75);
  EXPECT_DOUBLE_EQ(s.sim_error[kPredictedVelocity], 17.5);
}

TEST(PredictionStarts, EveryStartHasItsWholeHorizonAhead) {
  const StateTrack track = flown(estimate::model_values(small_vehicle()), 99);  // 100 states
  EXPECT_EQ(prediction_starts(track, 50).size(), 50u);
  EXPECT_EQ(prediction_starts(track, 50).back(), 49u);
  EXPECT_EQ(prediction_starts(track, 50, 10).size(), 5u);
  EXPECT_TRUE(prediction_starts(track, 100).empty());
}

TEST(HelpfulRangeOfHorizons, IsTheLongestRunOfStepsThatAreAllBetter) {
  PredictionErrors a = constant(10, 8, 1.0);
  const PredictionErrors b = constant(10, 8, 1.1);
  for (std::size_t s = 0; s < 10; ++s) a.error[kPredictedRates][s * 8 + 1] = 1.2;  // worse at step 2 alone
  const PredictionSummary better = summary({&a, 1}), worse = summary({&b, 1});
  EXPECT_NEAR(helpful_range(better, worse, kPredictedRates).from_s, 0.03, 1e-12);
  EXPECT_NEAR(helpful_range(better, worse, kPredictedRates).to_s, 0.08, 1e-12);
  EXPECT_NEAR(helpful_range(better, worse, kPredictedPosition).from_s, 0.01, 1e-12);
  EXPECT_EQ(helpful_range(worse, better, kPredictedPosition).to_s, 0.0);
}

TEST(ErrorRatioOfPredictions, IsExactWhenOneErrsInProportionToTheOther) {
  std::vector<PredictionErrors> a{constant(2000, 5, 0.0)};
  const RandomStream random(3, 1);
  for (auto& x : a[0].error) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = random.uniform(i);
  }
  std::vector<PredictionErrors> b = a;
  for (auto& x : b[0].error) {
    for (double& e : x) e *= 2.0;
  }
  const ErrorRatio r = error_ratio(a, b, kPredictedVelocity, 1, 5);
  EXPECT_NEAR(r.value, 0.5, 1e-12);
  EXPECT_NEAR(r.low, 0.5, 1e-12);  // paired: what both share cancels
  EXPECT_NEAR(r.high, 0.5, 1e-12);
}

// Errors correlated over 0.5 s, as those of overlapping windows are, about 1.0 for `a` and 1.0 for `b`.
std::vector<PredictionErrors> correlated(std::uint64_t seed) {
  std::vector<PredictionErrors> e{constant(6000, 1, 0.0)};
  const RandomStream random(seed, 7);
  double x = 0.0;
  for (std::size_t k = 0; k < 6000; ++k) {
    x += -x * 0.02 + 0.06 * random.gaussian(k);
    e[0].error[kPredictedRates][k] = 1.0 + x;
  }
  return e;
}

TEST(ErrorRatioOfPredictions, TwoSecondBlocksCoverCorrelatedErrorsWhereSingleSamplesDoNot) {
  int by_block = 0, by_sample = 0;
  constexpr int kTrials = 100;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto a = correlated(2 * static_cast<std::uint64_t>(trial)), b = correlated(2 * static_cast<std::uint64_t>(trial) + 1);
    const auto covers = [&](double block_s) {
      const ErrorRatio r = error_ratio(a, b, kPredictedRates, 1, 1, {.block_s = block_s, .resamples = 200});
      return r.low <= 1.0 && 1.0 <= r.high;
    };
    by_block += covers(2.0);
    by_sample += covers(0.01);
  }
  EXPECT_GE(by_block, 85);
  EXPECT_LE(by_sample, 50);
}

TEST(ErrorRatioOfPredictions, RepeatsForASeedAndChangesWithIt) {
  const auto a = correlated(1), b = correlated(2);
  const auto r = [&](std::uint64_t seed) { return error_ratio(a, b, kPredictedRates, 1, 1, {.resamples = 200, .seed = seed}); };
  EXPECT_EQ(r(5).low, r(5).low);
  EXPECT_NE(r(5).low, r(6).low);
}

TEST(ErrorRatioOfPredictions, RefusesPredictionsThatAreNotPaired) {
  const std::vector<PredictionErrors> a{constant(100, 5, 1.0)}, fewer{constant(90, 5, 1.0)};
  EXPECT_THROW(error_ratio(a, fewer, kPredictedRates, 1, 5), Error);
  EXPECT_THROW(error_ratio(a, a, kPredictedRates, 1, 6), Error);
  EXPECT_THROW(error_ratio(a, a, kPredictedRates, 0, 5), Error);
}

TEST(MultiStepFit, RecoversTheParametersThatMadeAFlight) {
  const estimate::ModelValues truth = estimate::model_values(small_vehicle());
  const std::vector<StateTrack> tracks{flown(truth, 350)};
  estimate::ModelValues start = truth;
  start[estimate::kIxx] *= 1.4;
  start[estimate::kIyy] *= 0.7;
  start[estimate::kK1] *= 1.1;
  start[estimate::kCdh] = 0.01;
  start[estimate::kComX] = 2e-4;
  MultiStepOptions o;
  o.horizon = 30;
  o.stride = 20;
  o.tolerance = 1e-12;
  const MultiStepFit fit =
      fit_multi_step(start, {estimate::kIxx, estimate::kIyy, estimate::kK1, estimate::kCdh, estimate::kComX}, tracks, o);
  EXPECT_TRUE(fit.converged);
  EXPECT_LT(fit.cost, 1e-12);
  EXPECT_NEAR(fit.values[estimate::kIxx] / truth[estimate::kIxx], 1.0, 1e-4);
  EXPECT_NEAR(fit.values[estimate::kIyy] / truth[estimate::kIyy], 1.0, 1e-4);
  EXPECT_NEAR(fit.values[estimate::kK1] / truth[estimate::kK1], 1.0, 1e-4);
  EXPECT_NEAR(fit.values[estimate::kCdh] / truth[estimate::kCdh], 1.0, 1e-4);
  EXPECT_NEAR(fit.values[estimate::kComX], 0.0, 1e-7);
}

TEST(MultiStepFit, ParametersStayWithinTheirBounds) {
  host::TermList terms;
  ASSERT_TRUE(terms.add(kTorqueShare));
  const int roll = estimate::find_parameter("effect.prediction.torque_share.roll", terms);
  estimate::ModelValues truth = estimate::model_values(small_vehicle(), terms);
  estimate::ModelValues start = truth;
  truth[estimate::kIxx] /= 2.5;  // as if 2.5 times the torque acted; the bound is 2
  const std::vector<StateTrack> tracks{flown(truth, 200)};
  EXPECT_EQ(fit_multi_step(start, {roll}, tracks).values[roll], 2.0);
}

// Why parameters that predict are not the vehicle's: measurement noise on rotor speeds makes less than the whole torque the best guess.
TEST(MultiStepFit, NoiseOnRotorSpeedsPullsTheFittedShareOfTorqueBelowOneAndPredictsBetter) {
  host::TermList terms;
  ASSERT_TRUE(terms.add(kTorqueShare));
  const estimate::ModelValues truth = estimate::model_values(small_vehicle(), terms);
  const int roll = estimate::find_parameter("effect.prediction.torque_share.roll", terms);
  const int pitch = estimate::find_parameter("effect.prediction.torque_share.pitch", terms);
  MultiStepOptions o;
  o.stride = 10;
  const std::vector<StateTrack> clean{flown(truth, speeds(10.0), speeds(10.0), 990)};
  const MultiStepFit without = fit_multi_step(truth, {roll, pitch}, clean, o);
  EXPECT_NEAR(without.values[roll], 1.0, 1e-6);
  const std::vector<StateTrack> noisy{flown(truth, speeds(10.0), speeds(10.0, 60.0), 990)};
  const MultiStepFit with = fit_multi_step(truth, {roll, pitch}, noisy, o);
  EXPECT_LT(with.values[roll], 0.8);
  EXPECT_LT(with.values[pitch], 0.8);
  // On another flight with other noise.
  const StateTrack other = flown(truth, speeds(10.0), speeds(10.0, 60.0, 99), 990);
  const PredictionErrors whole = errors_of(other, whole_model(truth)), shared = errors_of(other, whole_model(with.values));
  EXPECT_LT(summary({&shared, 1}).sim_error[kPredictedRates], summary({&whole, 1}).sim_error[kPredictedRates]);
}

}  // namespace
}  // namespace rotorloop::score
