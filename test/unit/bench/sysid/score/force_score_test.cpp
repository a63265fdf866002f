// The force score: what it counts as error, and that places and biases of the sensors are not counted.
#include "test/support/force_score.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bench/sysid/estimate/model/model.hpp"
#include "host/base/error.hpp"

namespace rotorloop::score {
namespace {

using Eigen::Vector3d;

estimate::ModelValues vehicle() {
  host::VehicleModel m;
  m.mass_kg = 0.7;
  m.inertia_kg_m2 = {2e-3, 3e-3, 5e-3};
  for (std::size_t i = 0; i < 4; ++i) m.rotors[i].reaction = i < 2 ? -1 : 1;
  m.rotors[0].position_m = {0.09, -0.09, 0};
  m.rotors[1].position_m = {-0.09, 0.09, 0};
  m.rotors[2].position_m = {0.09, 0.09, 0};
  m.rotors[3].position_m = {-0.09, -0.09, 0};
  m.thrust = {3e-6, -1.5e-4, 0.0635, 1.2};
  m.c_q_N_m_s2 = 3e-8;
  m.drag = {0.017, 0.006, 0.018};
  return estimate::model_values(m);
}

constexpr double kTurn_rad_s = 3.0;
const Vector3d kVelocity(3.0, -1.0, 0.5);

// A second at constant velocity, turning about z; specific force as the model says plus `error_N` over mass.
log::FlightRecord flight(const estimate::ModelValues& truth, const Vector3d& error_N) {
  log::FlightRecord record;
  record.name = "made";
  record.source = "made.csv";
  for (int k = 0; k <= 400; ++k) {
    const double t = 0.0025 * k, angle = kTurn_rad_s * t;
    estimate::BodyState x;
    x.q_WB = Eigen::Quaterniond(std::cos(angle / 2), 0, 0, std::sin(angle / 2));
    x.v_W_m_s = kVelocity;
    x.w_B_rad_s = {0, 0, kTurn_rad_s};
    estimate::RotorInputSample input;
    for (std::size_t i = 0; i < 4; ++i) input.omega_rad_s[i] = 900.0 + 20.0 * static_cast<double>(i);
    const Vector3d force_N = estimate::Model(truth).instant(x, input, t).force_B_N;
    const Vector3d imu(truth[estimate::kImuX], truth[estimate::kImuY], truth[estimate::kImuZ]);
    const Vector3d place = x.w_B_rad_s.cross(x.w_B_rad_s.cross(imu));
    const Vector3d bias(truth[estimate::kAccelBiasX], truth[estimate::kAccelBiasY], truth[estimate::kAccelBiasZ]);
    record.pose.add(t, {x.p_W_m, x.q_WB});
    record.velocity_W_m_s.add(t, x.v_W_m_s);
    record.gyro_B_rad_s.add(t, x.w_B_rad_s);
    record.accel_B_m_s2.add(t, (force_N - error_N) / truth[estimate::kMass] + place + bias);
    record.rotor_omega_rad_s.add(t, input.omega_rad_s);
  }
  return record;
}

TEST(ForceScore, ErrorIsModelMinusMeasuredPerAxisAndByLength) {
  const estimate::ModelValues truth = vehicle();
  const ForceScore s = score_force(flight(truth, {0.3, -0.4, 1.2}), truth);
  EXPECT_EQ(s.flight, "made");
  EXPECT_EQ(s.samples, 401u);
  EXPECT_NEAR(s.rms_N, 1.3, 1e-9);
  EXPECT_NEAR(s.axis_rms_N.y(), 0.4, 1e-9);
  EXPECT_NEAR(s.mean_N.y(), -0.4, 1e-9);
  EXPECT_NEAR(s.mean_N.z(), 1.2, 1e-9);
}

TEST(ForceScore, PlaceAndBiasOfTheAccelerometerDoNotCount) {
  estimate::ModelValues truth = vehicle();
  truth[estimate::kImuX] = 0.05;
  truth[estimate::kImuY] = -0.02;
  truth[estimate::kAccelBiasY] = 0.07;
  const log::FlightRecord record = flight(truth, Vector3d::Zero());
  EXPECT_LT(score_force(record, truth).rms_N, 1e-9);
  estimate::ModelValues unaware = vehicle();
  // 9 rad²/s² x 54 mm and 0.07 m/s² on 0.7 kg.
  EXPECT_GT(score_force(record, unaware).rms_N, 0.25);
}

TEST(ForceScore, DragLeftOutShowsAsItsForce) {
  const estimate::ModelValues truth = vehicle();
  estimate::ModelValues without = truth;
  without[estimate::kCdh] = without[estimate::kCdxy] = 0.0;
  const ForceScore s = score_force(flight(truth, Vector3d::Zero()), without);
  EXPECT_GT(std::hypot(s.axis_rms_N.x(), s.axis_rms_N.y()), 0.3);  // 7 N x 0.017 s/m x 3.2 m/s, and the airframe's
  EXPECT_LT(s.axis_rms_N.z(), 1e-9);
}

TEST(ForceScore, PredictionOfTheLogIsScoredOnTheSameSamples) {
  const estimate::ModelValues truth = vehicle();
  log::FlightRecord record = flight(truth, Vector3d::Zero());
  EXPECT_FALSE(score_logged_force(record, truth, "published_f"));
  for (std::size_t k = 0; k < record.accel_B_m_s2.size(); ++k) {
    const Vector3d measured_N = truth[estimate::kMass] * record.accel_B_m_s2.value[k];
    const double t = record.accel_B_m_s2.t_s[k];
    record.extra["published_fx[N]"].add(t, measured_N.x() + 0.1);
    record.extra["published_fy[N]"].add(t, measured_N.y());
    record.extra["published_fz[N]"].add(t, measured_N.z() - 0.2);
  }
  const auto s = score_logged_force(record, truth, "published_f");
  ASSERT_TRUE(s);
  EXPECT_NEAR(s->axis_rms_N.x(), 0.1, 1e-9);
  EXPECT_NEAR(s->mean_N.z(), -0.2, 1e-9);
}

TEST(ForceScore, PooledWeighsFlightsByTheirSamples) {
  ForceScore a{"a", 100, 1.0, {1, 0, 0}, {1, 0, 0}}, b{"b", 300, 2.0, {0, 2, 0}, {0, -2, 0}};
  const ForceScore all = pooled(std::vector{a, b});
  EXPECT_EQ(all.samples, 400u);
  EXPECT_NEAR(all.rms_N, std::sqrt((100 * 1.0 + 300 * 4.0) / 400), 1e-12);
  EXPECT_NEAR(all.mean_N.y(), -1.5, 1e-12);
}

TEST(ForceScore, MissingVelocityIsNamed) {
  const estimate::ModelValues truth = vehicle();
  log::FlightRecord record = flight(truth, Vector3d::Zero());
  record.velocity_W_m_s = {};
  try {
    score_force(record, truth);
    FAIL() << "scored";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::data_quality);
    EXPECT_NE(std::string(e.what()).find("no velocity in flight made"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace rotorloop::score
