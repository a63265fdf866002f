// Cuts in a flight: no step of the model crosses them, nothing is tied to what lies between, and what is left is still a fit.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "bench/sysid/estimate/estimator.hpp"
#include "bench/sysid/identify/identify.hpp"
#include "host/base/error.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::estimate {
namespace {

log::FlightRecord short_flight(double pose_delay_s = 0.0) {
  model_true::Truth truth;
  truth.pose_delay_s = pose_delay_s;
  model_true::FlightSettings s;
  s.manoeuvre = model_true::Manoeuvre::rotation;
  s.duration_s = 4.0;
  return model_true::fly(truth, s).record;
}

std::size_t links(const GridFlight& g) { return static_cast<std::size_t>(std::accumulate(g.linked.begin(), g.linked.end(), 0)); }

TEST(Grid, ASplitBetweenTwoMeasurementsCutsExactlyTheStepBetweenThem) {
  const log::FlightRecord record = short_flight();
  GridFlight g = make_grid(record, {});
  const std::size_t before = links(g), at = record.pose.size() / 2;
  identify::cut_between_segments(g, {{record.pose.t_s.front(), record.pose.t_s[at]}, {record.pose.t_s[at + 1], record.pose.t_s.back()}});
  EXPECT_EQ(links(g), before - 1);
}

log::FlightRecord with_gyro_along_a_parabola() {
  log::FlightRecord record = short_flight();
  record.gyro_B_rad_s = {};
  const double t0 = record.pose.t_s.front();
  for (double t = t0; t < record.pose.t_s.back(); t += 1e-3) {
    const double s = t - t0;
    record.gyro_B_rad_s.add(t, Eigen::Vector3d(1.0, 2.0 * s, 300.0 * s * s));
  }
  return record;
}

GridFlight with_its_gyro(const log::FlightRecord& record, double rate_Hz) {
  GridOptions o;
  o.rate_Hz = rate_Hz;
  o.use_gyro = true;
  return make_grid(record, o);
}

TEST(Grid, TwentyGyroMeasurementsAboutANodeSayTheRateThereAndNotTheMeanOfACurve) {
  const log::FlightRecord record = with_gyro_along_a_parabola();
  const GridFlight g = with_its_gyro(record, 50.0);
  ASSERT_GT(g.gyro.size(), 100u);
  for (std::size_t i = 1; i + 1 < g.gyro.size(); ++i) {  // the mean would be 10 mrad/s higher: 300 · 0.02² / 12
    const double s = g.time_s(g.gyro[i].node) - record.pose.t_s.front();
    EXPECT_EQ(g.gyro[i].late_s, 0.0);
    EXPECT_LT((g.gyro[i].value - Eigen::Vector3d(1.0, 2.0 * s, 300.0 * s * s)).norm(), 1e-9) << s << " s";
  }
}

TEST(Grid, FiveGyroMeasurementsAboutANodeSayTheRateThereByAParabolaOverAStepOnEitherSide) {
  const log::FlightRecord record = with_gyro_along_a_parabola();
  const GridFlight g = with_its_gyro(record, 200.0);
  ASSERT_GT(g.gyro.size(), 400u);
  for (std::size_t i = 2; i + 2 < g.gyro.size(); ++i) {
    const double s = g.time_s(g.gyro[i].node) - record.pose.t_s.front();
    EXPECT_EQ(g.gyro[i].late_s, 0.0);
    EXPECT_LT((g.gyro[i].value - Eigen::Vector3d(1.0, 2.0 * s, 300.0 * s * s)).norm(), 1e-9) << s << " s";
  }
}

// Beside a gap there are measurements on one side only: a parabola would be extrapolated.
TEST(Grid, MeasurementsOnOneSideOfANodeAreAveragedAtTheirMeanTime) {
  log::FlightRecord record = with_gyro_along_a_parabola();
  const double t0 = record.pose.t_s.front();
  log::Stream<Eigen::Vector3d> with_gap;
  for (std::size_t k = 0; k < record.gyro_B_rad_s.size(); ++k) {
    const double t = record.gyro_B_rad_s.t_s[k];
    if (t < t0 + 0.9999 || t > t0 + 1.1) with_gap.add(t, record.gyro_B_rad_s.value[k]);
  }
  record.gyro_B_rad_s = with_gap;
  const GridFlight g = with_its_gyro(record, 200.0);
  std::size_t beside_a_gap = 0;
  for (const VectorFix& fix : g.gyro) {
    const double s = g.time_s(fix.node) - t0;
    if (s < 0.1 || s > 1.9) continue;
    beside_a_gap += fix.late_s != 0.0;
    EXPECT_NEAR(fix.value.y(), 2.0 * (s + fix.late_s), 1e-9);
    EXPECT_LE(std::fabs(fix.late_s), 2.5e-3 + 1e-9);
  }
  EXPECT_GE(beside_a_gap, 1u);
  EXPECT_LE(beside_a_gap, 4u);
}

TEST(Grid, AGapInRotorSpeedsTiesNoPoseIntoItEvenWhenPosesAreLate) {
  log::FlightRecord record = short_flight(0.015);
  const double t0 = record.rotor_omega_rad_s.t_s.front();
  log::Stream<log::RotorValues> with_gap;
  for (std::size_t k = 0; k < record.rotor_omega_rad_s.size(); ++k) {
    const double t = record.rotor_omega_rad_s.t_s[k];
    if (t < t0 + 1.9 || t > t0 + 2.1) with_gap.add(t, record.rotor_omega_rad_s.value[k]);
  }
  record.rotor_omega_rad_s = with_gap;
  GridFlight g = make_grid(record, {});
  associate_poses(g, 0.015);
  for (const PoseFix& f : g.pose) EXPECT_TRUE(g.tied(f.node)) << "pose at node " << f.node;

  host::VehicleModel m;
  m.mass_kg = 0.682;
  m.inertia_kg_m2 = {2.41e-3, 3.42e-3, 5.22e-3};
  const double l = 0.0885;
  m.rotors = {{{{l, -l, 0}, -1}, {{-l, l, 0}, -1}, {{l, l, 0}, 1}, {{-l, -l, 0}, 1}}};
  m.thrust = {3.12e-6, -1.55e-4, 0.0635, 1.2};
  m.c_q_N_m_s2 = 3.1e-8;
  m.drag = {0.0175, 0.0055, 0.0185};
  m.pose_sensor_p_BS_m = model_true::Truth{}.r_BS_m;
  m.pose_sensor_q_BS = model_true::Truth{}.q_BS;
  FitProblem p;
  p.start = model_values(m);
  p.flights = {&g};
  p.free = {{kIxx}, {kIyy}, {kComX}, {kComY}, {kK1}, {kPoseDelay}};
  p.noise.force_m_s2_rtHz.setConstant(0.03);
  p.noise.angular_rad_s2_rtHz.setConstant(0.3);
  const Fit f = fit(p);
  EXPECT_TRUE(f.converged);
  EXPECT_NEAR(f.find(kPoseDelay)->value, 0.015, 5e-4);
  EXPECT_NEAR(2.0 * f.cost / f.degrees_of_freedom, 1.0, 0.1);
}

TEST(Grid, RotorSpeedsAt10HzAreRefusedWithTheGapTheyLeave) {
  log::FlightRecord record = short_flight();
  log::Stream<log::RotorValues> slow;
  for (std::size_t k = 0; k < record.rotor_omega_rad_s.size(); k += 100)
    slow.add(record.rotor_omega_rad_s.t_s[k], record.rotor_omega_rad_s.value[k]);
  record.rotor_omega_rad_s = slow;
  try {
    make_grid(record, {});
    FAIL() << "a flight without a single bridged step was taken";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::data_quality);
    EXPECT_NE(std::string(e.what()).find("0.05 s"), std::string::npos) << e.what();
  }
}

TEST(Grid, AStartValueThatIsNotANumberIsAnErrorAndNoEstimate) {
  const GridFlight g = make_grid(short_flight(), {});
  FitProblem p;
  p.start = model_values({});
  p.start[kMass] = std::numeric_limits<double>::quiet_NaN();
  p.flights = {&g};
  p.free = {{kK1}};
  EXPECT_THROW(fit(p), Error);
}

}  // namespace
}  // namespace rotorloop::estimate
