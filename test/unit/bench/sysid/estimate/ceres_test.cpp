// The own elimination and Ceres, on the same problems: both give the same cost, the same estimates and the same standard errors.
// They share the residuals and their derivatives; retraction, factorisation, damping, stopping and covariance are each their own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bench/sysid/estimate/ceres_solver.hpp"
#include "host/base/error.hpp"
#include "test/support/model_true_flight.hpp"
#include "test/support/model_true_vehicle.hpp"

namespace rotorloop::estimate {
namespace {

using model_true::Manoeuvre;

const model_true::Truth kTruth;

std::vector<FreeParameter> free_of(std::initializer_list<int> parameters) {
  std::vector<FreeParameter> out;
  for (const int p : parameters) out.push_back({.parameter = p});
  return out;
}
// The paper's θ and the delay of the poses: 18 numbers.
std::vector<FreeParameter> papers_parameters() {
  return free_of(
      {kIxx, kIyy, kIzz, kCq, kComX, kComY, kK1, kK2, kCdh, kCdxy, kCdz, kOffsetX, kOffsetY, kOffsetZ, kTurnX, kTurnY, kTurnZ, kPoseDelay});
}

ModelValues truth_values(const host::TermList& terms = {}) { return model_values(model_true::vehicle_of(kTruth), terms); }

// As far from the truth as a stand and a ruler leave it: every free value by `share` of itself and its scale, signs in turn.
ModelValues away_from(ModelValues v, const std::vector<FreeParameter>& free, double share) {
  double sign = 1.0;
  for (const FreeParameter& f : free) {
    v[f.parameter] += sign * share * (std::fabs(v[f.parameter]) + 0.1 * parameter_info(f.parameter, v.terms).scale);
    sign = -sign;
  }
  return v;
}

NoiseModel true_noise() {
  NoiseModel n;
  n.force_m_s2_rtHz.setConstant(0.03);
  n.angular_rad_s2_rtHz.setConstant(0.3);
  n.position_m.setConstant(2e-3);
  n.attitude_rad.setConstant(2e-3);
  return n;
}

FitProblem problem_of(std::vector<const GridFlight*> flights, const ModelValues& start, const std::vector<FreeParameter>& free) {
  return {.start = start, .free = free, .flights = std::move(flights), .noise = true_noise(), .flight_noise = {}, .flight_start = {}};
}

GridFlight flown(Manoeuvre manoeuvre, std::uint64_t seed, double duration_s) {
  return make_grid(model_true::fly(kTruth, {.manoeuvre = manoeuvre, .seed = seed, .duration_s = duration_s}).record, {});
}

FitOptions to_the_end(double robust_scale = 0.0) {
  FitOptions o;
  o.tolerance = 1e-9;
  o.robust_scale = robust_scale;
  return o;
}

void expect_same(const Fit& own, const Fit& ceres) {
  EXPECT_TRUE(own.converged);
  EXPECT_TRUE(ceres.converged);
  EXPECT_NEAR(ceres.cost / own.cost, 1.0, 1e-8);
  EXPECT_EQ(ceres.degrees_of_freedom, own.degrees_of_freedom);
  ASSERT_EQ(ceres.estimates.size(), own.estimates.size());
  for (std::size_t i = 0; i < own.estimates.size(); ++i) {
    const Estimate &a = own.estimates[i], &b = ceres.estimates[i];
    EXPECT_EQ(a.parameter, b.parameter);
    EXPECT_EQ(a.flight, b.flight);
    EXPECT_NEAR((b.value - a.value) / a.u, 0.0, 1e-4) << parameter_info(a.parameter, own.values[0].terms).name << " in standard errors";
    EXPECT_NEAR(b.u / a.u, 1.0, 1e-6) << parameter_info(a.parameter, own.values[0].terms).name;
    EXPECT_NEAR(b.prior_share, a.prior_share, 1e-6);
  }
  const Eigen::VectorXd scale = own.covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd apart = scale.asDiagonal() * (ceres.covariance - own.covariance) * scale.asDiagonal();
  EXPECT_LT(apart.cwiseAbs().maxCoeff(), 1e-6) << "of correlations";
  for (std::size_t f = 0; f < own.states.size(); ++f) {
    ASSERT_EQ(ceres.states[f].size(), own.states[f].size());
    StateError worst = StateError::Zero();
    for (std::size_t k = 0; k < own.states[f].size(); ++k)
      worst = worst.cwiseMax(difference(own.states[f][k], ceres.states[f][k]).cwiseAbs());
    EXPECT_LT(worst.maxCoeff(), 1e-4) << "m, m/s, rad, rad/s, of flight " << f;
  }
}

// Poses, gyro, accelerometer and velocity of one flight, with every 40th pose off by 0.1 m: what a tracking system does.
GridFlight flight_with_all_sensors(Manoeuvre manoeuvre, std::uint64_t seed, double duration_s) {
  model_true::FlightSettings s{.manoeuvre = manoeuvre, .seed = seed, .duration_s = duration_s, .imu_every_ms = 1};
  s.gyro_bias_rad_s = {0.01, -0.02, 0.005};
  s.accel_bias_m_s2 = {0.1, -0.05, 0.2};
  model_true::ModelTrueFlight f = model_true::fly(kTruth, s);
  for (std::size_t k = 0; k < f.states.size(); ++k) {
    const model_true::State& x = f.states[k];
    const Eigen::Vector3d wobble(std::sin(1.0 * static_cast<double>(k)), std::sin(1.7 * static_cast<double>(k)), 0.0);
    f.record.velocity_W_m_s.add(f.record.pose.t_s[k], x.v_W_m_s + x.q_WB * x.omega_B_rad_s.cross(kTruth.r_BS_m) + 0.05 * wobble);
    if (k % 40 == 20) f.record.pose.value[k].p_W_m.x() += 0.1;
  }
  return make_grid(f.record, {.use_velocity = true, .use_gyro = true, .use_accel = true});
}

// The flight's speeds as answers to commands given 30 ms before.
log::FlightRecord commanded(log::FlightRecord r) {
  for (std::size_t k = 0; k + 30 < r.rotor_omega_rad_s.size(); ++k) {
    log::RotorValues u = r.rotor_omega_rad_s.value[k + 30];
    for (double& v : u) v /= 2000.0;
    r.motor_command.add(r.rotor_omega_rad_s.t_s[k], u);
  }
  r.rotor_omega_rad_s = {};
  return r;
}

TEST(IdentifyCeres, GivesTheSameFitOfPosesFromDifferentStarts) {
  const GridFlight up = flown(Manoeuvre::vertical, 1, 2.0), fast = flown(Manoeuvre::horizontal, 2, 2.0);
  const GridFlight turning = flown(Manoeuvre::rotation, 3, 2.0);
  const auto free = papers_parameters();
  const auto start = [&](double share) { return problem_of({&up, &fast, &turning}, away_from(truth_values(), free, share), free); };
  const Fit own = fit(start(0.05), to_the_end());
  expect_same(own, fit_with_ceres(start(0.05), to_the_end()));
  expect_same(own, fit_with_ceres(start(-0.1), to_the_end()));
}

TEST(IdentifyCeres, GivesTheSameFitOfAllSensorsWithRobustLossPriorsAndParametersOfEachFlight) {
  std::vector<GridFlight> grids{flight_with_all_sensors(Manoeuvre::vertical, 5, 2.0), flight_with_all_sensors(Manoeuvre::rotation, 6, 2.0)};
  auto free = papers_parameters();
  for (FreeParameter& f : free) {
    f.per_flight = f.parameter == kComX || f.parameter == kComY || f.parameter == kPoseDelay;
    if (f.parameter == kPoseDelay) f.prior_u = 1e-4;
    if (f.parameter == kCdxy || f.parameter == kCdz) f.prior_u = 2e-3;
  }
  for (const int p : {kGyroBiasX, kGyroBiasY, kGyroBiasZ, kAccelBiasX, kAccelBiasY, kAccelBiasZ})
    free.push_back({.parameter = p, .per_flight = true});
  for (const int p : {kImuX, kImuY, kImuZ}) free.push_back({.parameter = p, .prior_u = 0.01});
  const ModelValues start = away_from(truth_values(), free, 0.02);
  FitProblem p = problem_of({&grids[0], &grids[1]}, start, free);
  p.flight_noise = {true_noise(), true_noise()};
  p.flight_noise[1].position_m = {3e-3, 2e-3, 4e-3};
  p.flight_start = {start.values, away_from(start, free, 0.01).values};
  const Fit own = fit(p, to_the_end(3.0));
  expect_same(own, fit_with_ceres(p, to_the_end(3.0)));
  EXPECT_GT(own.find(kPoseDelay, 0)->prior_share, 0.1) << "the prior counts";
  EXPECT_GT(fit(p, to_the_end()).cost, 2.0 * own.cost) << "so does the loss";
}

TEST(IdentifyCeres, GivesTheSameFitOfAModelWithAddedTermsOneAtItsBoundWhenTheRotorLogHasAGap) {
  host::TermList terms;
  terms.add(*host::find_term("rotor_local_inflow"));
  terms.add(*host::find_term("rotor_inertia_reaction"));
  // Equations 1 to 8 have neither effect; a late rotor log looks like local inflow, more of it than there can be: it ends at its bound.
  model_true::Truth late = kTruth;
  late.rotor_delay_s = 0.004;
  model_true::ModelTrueFlight f = model_true::fly(late, {.manoeuvre = Manoeuvre::rotation, .seed = 9, .duration_s = 4.0});
  for (std::size_t k = 2000; k < 2200; ++k) f.record.rotor_omega_rad_s.value[k].fill(std::nan(""));
  const GridFlight grid = make_grid(f.record, {});
  ASSERT_LT(std::count(grid.linked.begin(), grid.linked.end(), 1), static_cast<std::ptrdiff_t>(grid.nodes) - 30) << "the chain is cut";
  const auto free = free_of({kIxx, kIyy, kCq, kK1, kComX, kComY, kCoreParameters, kCoreParameters + 1});
  ModelValues start = away_from(truth_values(terms), free, 0.05);
  start[kCoreParameters] = 0.5;
  start[kCoreParameters + 1] = 3e-6;
  const FitProblem p = problem_of({&grid}, start, free);
  const Fit own = fit(p, to_the_end());
  expect_same(own, fit_with_ceres(p, to_the_end()));
  EXPECT_EQ(own.find(kCoreParameters)->value, 1.3);
}

TEST(IdentifyCeres, GivesTheSameFitOfGyroAccelerometerAndMotorCommandsAlone) {
  log::FlightRecord r =
      commanded(model_true::fly(kTruth, {.manoeuvre = Manoeuvre::rotation, .seed = 12, .duration_s = 6.0, .imu_every_ms = 1}).record);
  r.pose = {};
  const GridFlight grid = make_grid(r, {.use_pose = false});
  ASSERT_GT(grid.anchor.norm(), 0.0);
  ModelValues start = truth_values();
  start[kCommandGain] = 2000.0;
  start[kCommandLag] = 0.03;
  const auto free = free_of({kIxx, kIyy, kIzz, kCommandGain, kCommandLag, kGyroBiasX, kGyroBiasY, kGyroBiasZ});
  const FitProblem p = problem_of({&grid}, away_from(start, free, 0.05), free);
  expect_same(fit(p, to_the_end()), fit_with_ceres(p, to_the_end()));
}

TEST(IdentifyCeres, RefusesWhatTheDataDoNotTell) {
  // At a constant battery voltage the gain of a motor and the exponent of its voltage law are one number.
  log::FlightRecord r = commanded(model_true::fly(kTruth, {.manoeuvre = Manoeuvre::rotation, .seed = 3, .duration_s = 1.5}).record);
  for (const double t : {0.0, 1.5}) r.battery_V.add(t, 15.0);
  const GridFlight grid = make_grid(r, {});
  ModelValues start = truth_values();
  start[kCommandGain] = 2000.0;
  start.reference_V = 16.0;
  const FitProblem p = problem_of({&grid}, start, free_of({kIxx, kIyy, kIzz, kCommandGain, kVoltageExponent}));
  for (const auto& solve : {&fit, &fit_with_ceres}) {
    try {
      solve(p, {}, {});
      ADD_FAILURE() << "no error";
    } catch (const Error& e) {
      EXPECT_EQ(e.exit_code(), ExitCode::data_quality) << e.what();
    }
  }
}

TEST(IdentifyCeres, SaysThatItDoesNotEstimateTheNoiseAndNamesAStartOutsideItsRange) {
  const GridFlight grid = flown(Manoeuvre::rotation, 3, 1.5);
  const auto refused = [&](const ModelValues& start, const FitOptions& o) {
    try {
      fit_with_ceres(problem_of({&grid}, start, free_of({kIxx, kIyy})), o);
      return std::string("no error");
    } catch (const Error& e) {
      EXPECT_EQ(e.exit_code(), ExitCode::usage);
      return std::string(e.what());
    }
  };
  FitOptions with_noise;
  with_noise.noise.rounds = 5;
  EXPECT_THAT(refused(truth_values(), with_noise), testing::HasSubstr("no EM for the noise"));
  ModelValues start = truth_values();
  start[kIyy] = -0.004;
  EXPECT_THAT(refused(start, {}), testing::HasSubstr("body.inertia.yy is -0.004 kg m2, allowed 1e-09 to 1000"));
}

}  // namespace
}  // namespace rotorloop::estimate
