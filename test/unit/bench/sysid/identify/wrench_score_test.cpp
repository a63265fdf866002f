// The score of force and torque against a flight made from geometry alone, whose rotor speeds are those that its motion needs.
#include "bench/sysid/identify/wrench_score.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/sysid/identify/report/held_out_sections.hpp"
#include "bench/sysid/log/stream_reader.hpp"
#include "test/unit/bench/sysid/estimate/analytic_flight.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kCt_N_s2 = 1.6e-6, kTorquePerThrust_m = 0.02;  // of analytic_flight.hpp
enum : Eigen::Index { kForceX, kForceY, kForceZ, kTorqueX, kTorqueY, kTorqueZ };

estimate::ModelValues true_values(const estimate::testing::AnalyticFlight& f) {
  estimate::ModelValues v = estimate::model_values(f.vehicle);
  v[estimate::kK1] = kCt_N_s2;
  v[estimate::kK2] = 0.0;
  v[estimate::kCq] = kCt_N_s2 * kTorquePerThrust_m;
  v[estimate::kCdh] = v[estimate::kCdxy] = v[estimate::kCdz] = 0.0;
  return v;
}

Identification fit_of(const estimate::ModelValues& values) {
  Identification r;
  r.start.file = values;
  r.fit.values = {values};
  r.fit.noise = {estimate::NoiseModel{}};
  return r;
}

// The flight's own motion ends at 2 Hz.
WrenchComparison score(const log::FlightRecord& record, const estimate::ModelValues& before, const estimate::ModelValues& after,
                       const WrenchBand& band = {.from_Hz = 0.0, .to_Hz = 3.0}) {
  return score_wrenches({{record, FlightRole::any, {}, {}}}, fit_of(before), fit_of(after), {.rate_Hz = 100.0}, band);
}

TEST(WrenchScore, TrueModelExplainsEveryAxisThatMovesAndATorqueThatIsLeftOutShowsAboutItsAxisAlone) {
  const estimate::testing::AnalyticFlight f = estimate::testing::analytic_flight();
  const estimate::ModelValues truth = true_values(f);
  estimate::ModelValues without_yaw = truth;
  without_yaw[estimate::kCq] = 0.0;
  const WrenchComparison c = score(f.record, without_yaw, truth);
  ASSERT_EQ(c.after.size(), 2u);  // the flight, and all in one pot
  EXPECT_EQ(c.after.front().flight, "analytic");
  EXPECT_EQ(c.after.back().samples, c.after.front().samples);
  for (const Eigen::Index axis : {kForceZ, kTorqueX, kTorqueY, kTorqueZ}) EXPECT_GT(c.after.back().explained[axis], 0.9) << axis;
  EXPECT_LT(c.before.back().explained[kTorqueZ], 0.05);
  EXPECT_NEAR(c.before.back().explained[kTorqueX], c.after.back().explained[kTorqueX], 1e-9);
  EXPECT_NEAR(c.before.back().force_N(), c.after.back().force_N(), 1e-9);
}

TEST(WrenchScore, ThrustOneTenthTooHighIsOneTenthOfTheThrustInNewtons) {
  const estimate::testing::AnalyticFlight f = estimate::testing::analytic_flight();
  const estimate::ModelValues truth = true_values(f);
  estimate::ModelValues strong = truth;
  strong[estimate::kK1] *= 1.1;
  const WrenchComparison c = score(f.record, strong, truth);
  // 0.7 kg; 9.81 m/s² and climbs of 2.4 and 4.1 m/s² in sines: 10.4 m/s² rms.
  EXPECT_NEAR(c.before.back().rms[kForceZ], 0.1 * 0.7 * 10.4, 0.05);
  EXPECT_LT(c.after.back().rms[kForceZ], 0.1);
  EXPECT_LT(c.before.back().explained[kForceZ], c.after.back().explained[kForceZ] - 0.05);
}

TEST(WrenchScore, RotorSpeedsStampedTwentyMillisecondsEarlyCostTorqueThatAlignmentGivesBack) {
  estimate::testing::AnalyticFlight f = estimate::testing::analytic_flight();
  const estimate::ModelValues truth = true_values(f);
  const WrenchScore on_time = score(f.record, truth, truth).after.back();
  for (double& t : f.record.rotor_omega_rad_s.t_s) t -= 0.020;
  const WrenchComparison c = score(f.record, truth, truth);
  EXPECT_NEAR(c.after_aligned.front().delay_s, 0.020, 0.0026);
  EXPECT_GT(c.after.back().torque_N_m(), 1.2 * on_time.torque_N_m());
  EXPECT_LT(c.after_aligned.back().torque_N_m(), 1.1 * on_time.torque_N_m());
}

TEST(WrenchScore, AnAccelerometer120MillimetresAheadIsScoredByTheModelsAngularAccelerationBesideTheMeasuredOne) {
  estimate::testing::AnalyticFlight f = estimate::testing::analytic_flight();
  estimate::ModelValues truth = true_values(f);
  truth[estimate::kImuX] = 0.12;
  const Eigen::Vector3d place_m(0.12, 0.0, 0.0);
  log::StreamReader<Eigen::Vector3d> before(f.record.gyro_B_rad_s), at(f.record.gyro_B_rad_s), after(f.record.gyro_B_rad_s);
  for (std::size_t i = 0; i < f.record.accel_B_m_s2.size(); ++i) {
    const double t = f.record.accel_B_m_s2.t_s[i], half_s = 0.005;
    const Eigen::Vector3d slope = (after.at(t + half_s) - before.at(t - half_s)) / (2.0 * half_s), w = at.at(t);
    f.record.accel_B_m_s2.value[i] += slope.cross(place_m) + w.cross(w.cross(place_m));
  }
  estimate::ModelValues sluggish = truth;  // turns half as fast in pitch as it should
  sluggish[estimate::kIyy] *= 2.0;
  const WrenchComparison c = score(f.record, sluggish, truth);
  ASSERT_EQ(c.after.size(), 3u);
  EXPECT_EQ(c.after[1].flight, "analytic, at the accelerometer");
  EXPECT_EQ(c.after.back().flight, "pooled");
  EXPECT_NEAR(c.after[1].rms[kForceZ], c.after[0].rms[kForceZ], 0.02) << "N: a true model has the true angular acceleration";
  EXPECT_NEAR(c.before[0].rms[kForceZ], c.after[0].rms[kForceZ], 0.02) << "the measured one does not care for the inertia";
  EXPECT_GT(c.before[1].rms[kForceZ], c.after[1].rms[kForceZ] + 0.02) << "the model's own does";
}

TEST(WrenchScore, FlightsWithoutInertialSensorsGiveNoScore) {
  estimate::testing::AnalyticFlight f = estimate::testing::analytic_flight();
  const estimate::ModelValues truth = true_values(f);
  f.record.gyro_B_rad_s = {};
  f.record.accel_B_m_s2 = {};
  const WrenchComparison c = score(f.record, truth, truth);
  EXPECT_TRUE(c.after.empty());
}

TEST(WrenchScore, TableNamesBandAxesAndUnits) {
  const estimate::testing::AnalyticFlight f = estimate::testing::analytic_flight();
  const estimate::ModelValues truth = true_values(f);
  const std::string text =
      render::terminal_text(wrench_sections(wrench_json(score(f.record, truth, truth, {.from_Hz = 1.0, .to_Hz = 10.0}))));
  for (const char* part : {"1 to 10 Hz", "force z", "torque z", "N m", "analytic", "pooled"})
    EXPECT_NE(text.find(part), std::string::npos) << part;
}

}  // namespace
}  // namespace rotorloop::identify
