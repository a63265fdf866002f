// The figures that flights are judged by, against values worked out by hand.
#include "bench/hil/flight/metrics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace rotorloop::hil {
namespace {
using ::testing::HasSubstr;
using ::testing::Not;

TrackingSample sample(double t, Eigen::Vector3d error_m, double speed_m_s, double yaw = 0) {
  TrackingSample s;
  s.t_s = t;
  s.sp_p_W_m = {t, 2 * t, 1};
  s.sp_v_W_m_s = {speed_m_s, 0, 0};
  s.sp_yaw_rad = yaw;
  s.true_p_W_m = s.sp_p_W_m + error_m;
  s.est_p_W_m = s.sp_p_W_m;
  return s;
}

TEST(TrackingError, IsTheMeanNormOfTrueMinusSetPointInCentimetres) {
  TrackingMeter m;
  m.add(sample(0, {0.03, 0, 0.04}, 1));
  m.add(sample(1, {0, 0, -0.12}, 1));
  const auto f = m.figures();
  EXPECT_NEAR(f.truth.mean_3d_cm, (5.0 + 12.0) / 2, 1e-12);
  EXPECT_NEAR(f.truth.mean_z_cm, (4.0 + 12.0) / 2, 1e-12);
  EXPECT_NEAR(f.truth.mean_horizontal_cm, 1.5, 1e-12);
  EXPECT_NEAR(f.truth.rms_3d_cm, std::sqrt((25.0 + 144.0) / 2), 1e-12);
  EXPECT_NEAR(f.truth.max_3d_cm, 12, 1e-12);
  EXPECT_NEAR(f.estimate.mean_3d_cm, 0, 1e-12) << "the estimate sat on the set-point";
  EXPECT_NEAR(f.estimator_mean_3d_cm, 8.5, 1e-12);
}

TEST(TrackingError, CountsFromFirstToLastMotionHoversBetweenIncluded) {
  TrackingMeter m;
  m.add(sample(0, {9, 0, 0}, 0));  // take-off hover: not counted
  m.add(sample(1, {0.01, 0, 0}, 1));
  m.add(sample(2, {0.04, 0, 0}, 0));  // pause between two motions: counted
  m.add(sample(3, {0.01, 0, 0}, 1));
  m.add(sample(4, {9, 0, 0}, 0));  // final hover: not counted
  const auto f = m.figures();
  EXPECT_NEAR(f.truth.mean_3d_cm, 2.0, 1e-12);
  EXPECT_NEAR(f.truth.max_3d_cm, 4.0, 1e-12);
  EXPECT_EQ(f.first_motion_s, 1.0);
  EXPECT_EQ(f.last_motion_s, 3.0);
  EXPECT_EQ(f.samples, 3u);
}

TEST(TrackingError, TurningOnTheSpotIsMotion) {
  TrackingMeter m;
  m.add(sample(0, {0.5, 0, 0}, 0, 0.0));
  m.add(sample(1, {0.02, 0, 0}, 0, 0.1));
  m.add(sample(2, {0.5, 0, 0}, 0, 0.1));
  EXPECT_NEAR(m.figures().truth.mean_3d_cm, 2.0, 1e-12);
}

TEST(TrackingError, OfATrajectoryThatNeverMovesIsNotMeasured) {
  TrackingMeter m;
  m.add(sample(0, {0.5, 0, 0}, 0));
  m.add(sample(1, {0.5, 0, 0}, 0));
  EXPECT_TRUE(std::isnan(m.figures().truth.mean_3d_cm));
}

TEST(Spread, SampleStandardDeviationIgnoresWhatWasNotMeasured) {
  const auto s = spread_of({1, 2, kNotMeasured, 3});
  EXPECT_EQ(s.n, 3);
  EXPECT_DOUBLE_EQ(s.mean, 2);
  EXPECT_DOUBLE_EQ(s.std, 1);
  EXPECT_DOUBLE_EQ(s.min, 1);
  EXPECT_DOUBLE_EQ(s.max, 3);
  EXPECT_EQ(spread_of({5}).std, 0);
  EXPECT_TRUE(std::isnan(spread_of({kNotMeasured}).mean));
}

FlightResult flown(const std::string& flight, Variant v, std::uint64_t seed, double e3d, double ez = 1.0) {
  FlightResult r;
  r.flight = flight;
  r.variant = v;
  r.seed = seed;
  r.tracking.truth.mean_3d_cm = e3d;
  r.tracking.truth.mean_z_cm = ez;
  r.tracking.estimate.mean_3d_cm = e3d + 0.1;
  r.tracking.estimate.mean_z_cm = ez + 0.1;
  r.tracking.estimator_mean_3d_cm = 1.2;
  r.bus_load_mean_percent = {61, 33};
  return r;
}

struct Assessed : ::testing::Test {
  Assessed() {
    s.seeds = {1, 2};
    s.variants = {Variant::pd_ff, Variant::pd_ff_thrust_drag};
    s.flights = {{"horizontal", "", {}}};
    s.limits.error = {{"horizontal", Variant::pd_ff_thrust_drag, 4.0, ErrorAxis::norm_3d}};
    s.limits.reduction = {{"horizontal", Variant::pd_ff, Variant::pd_ff_thrust_drag, 60, ErrorAxis::norm_3d}};
    s.limits.bus_load = {{70, std::nullopt}};
    results = {flown("horizontal", Variant::pd_ff, 1, 10), flown("horizontal", Variant::pd_ff, 2, 11),
               flown("horizontal", Variant::pd_ff_thrust_drag, 1, 3.5), flown("horizontal", Variant::pd_ff_thrust_drag, 2, 4.1)};
  }
  Scenario s;
  std::vector<FlightResult> results;
};

TEST_F(Assessed, PassesWhenEveryLimitIsMet) {
  const auto a = assess(s, results, 4);
  EXPECT_EQ(a.verdict, Verdict::pass);
  ASSERT_EQ(a.limits.size(), 4u);  // one error, one reduction, the load of two buses
  EXPECT_EQ(a.limits[0].name, "mean_tracking_error horizontal pd_ff_thrust_drag 3d");
  EXPECT_NEAR(a.limits[0].value, 3.8, 1e-12);
  EXPECT_NEAR(a.limits[1].value, 100 * (1 - 3.8 / 10.5), 1e-12);
  EXPECT_FALSE(a.limits[1].upper);
  EXPECT_EQ(a.limits[2].value, 61);
  EXPECT_EQ(a.limits[3].value, 33);
}
TEST_F(Assessed, ExactlyAtTheLimitPasses) {
  results[2].tracking.truth.mean_3d_cm = results[3].tracking.truth.mean_3d_cm = 4.0;
  EXPECT_TRUE(assess(s, results, 4).limits[0].pass);
}
TEST_F(Assessed, FailsWhenOneLimitIsMissed) {
  results[3].tracking.truth.mean_3d_cm = 4.6;  // mean 4.05
  const auto a = assess(s, results, 4);
  EXPECT_FALSE(a.limits[0].pass);
  EXPECT_EQ(a.verdict, Verdict::fail);
}
TEST_F(Assessed, OneOverloadedWindowOfOneFlightMissesTheBusLimit) {
  results[1].bus_load_mean_percent[1] = 71;
  EXPECT_EQ(assess(s, results, 4).verdict, Verdict::fail);
}
TEST_F(Assessed, IncompleteWhenAFlightIsMissingOrInterrupted) {
  EXPECT_EQ(assess(s, results, 5).verdict, Verdict::incomplete);
  results[0].end = FlightEnd::interrupted;
  EXPECT_EQ(assess(s, results, 4).verdict, Verdict::incomplete);
}
TEST_F(Assessed, IncompleteWhenALimitsVariantWasLeftOut) {
  results.resize(2);
  const auto a = assess(s, results, 2);
  EXPECT_EQ(a.verdict, Verdict::incomplete);
  EXPECT_TRUE(std::isnan(a.limits[0].value));
  EXPECT_FALSE(a.limits[0].pass);
}
TEST_F(Assessed, ACrashFailsTheRunAndDoesNotFlatterTheMean) {
  results[3].end = FlightEnd::crashed;
  results[3].tracking.truth.mean_3d_cm = 0.1;  // it hit the floor before the hard part
  const auto a = assess(s, results, 4);
  EXPECT_EQ(a.verdict, Verdict::fail);
  EXPECT_NEAR(a.limits[0].value, 3.5, 1e-12);
}
TEST_F(Assessed, VerticalFlightIsJudgedByItsVerticalComponent) {
  s.limits = {};
  s.limits.error = {{"horizontal", Variant::pd_ff, 1.5, ErrorAxis::z}};
  const auto a = assess(s, results, 4);
  EXPECT_NEAR(a.limits[0].value, 1.0, 1e-12);
  EXPECT_EQ(a.limits[0].name, "mean_tracking_error horizontal pd_ff z");
}

TEST_F(Assessed, ReductionIsOfTheMeansWithItsSpreadSeedBySeed) {
  const auto r = reduction(results, "horizontal", Variant::pd_ff, Variant::pd_ff_thrust_drag, ErrorAxis::norm_3d);
  const double one = 100 * (1 - 3.5 / 10), two = 100 * (1 - 4.1 / 11);
  EXPECT_NEAR(r.percent, 100 * (1 - 3.8 / 10.5), 1e-12);
  EXPECT_NEAR(r.std_percent, std::fabs(one - two) / std::sqrt(2.0), 1e-12);
  EXPECT_EQ(r.n, 2);
}

TEST_F(Assessed, TableShowsMeanSpreadReductionEstimateAndPublishedFigure) {
  s.published = {{"horizontal", Variant::pd_ff, 10.5, ErrorAxis::norm_3d, "paper Fig. 9"}};
  const auto a = assess(s, results, 4);
  const auto text = tracking_table_text(s, a, results);
  EXPECT_THAT(text, HasSubstr("horizontal (3-D)     PD FF               10.50 ± 0.71"));
  EXPECT_THAT(text, HasSubstr("63.8 ±"));
  EXPECT_THAT(text, HasSubstr("10.60"));  // from the estimate
  EXPECT_THAT(limits_text(a), HasSubstr("pass"));
  EXPECT_THAT(limits_text(a), Not(HasSubstr("MISSED")));
  s.published.clear();
  EXPECT_THAT(tracking_table_text(s, a, results), Not(HasSubstr("published"))) << "an empty column is not printed";
}

}  // namespace
}  // namespace rotorloop::hil
