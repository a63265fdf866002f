// The own elimination and Ceres, on the same problems: both give the same cost, the same estimates and the same standard errors.
// They share the residuals and their derivatives; retraction, factorisation, damping, stopping and covariance are each their own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bench/identify/ceres_solver.hpp"
#include "host/base/error.hpp"
#include "test/support/model_true_flight.hpp"
#include "test/support/model_true_vehicle.hpp"

namespace rotorloop::bench {
namespace {

using model_true::FlightSettings;
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

// Flights on their grids, and the problem that points to them.
struct Flights {
  std::vector<GridFlight> grids;
  explicit Flights(const FlightSettings& common, const GridOptions& options = {}) {
    for (const Manoeuvre m : {Manoeuvre::vertical, Manoeuvre::horizontal, Manoeuvre::rotation}) {
      FlightSettings s = common;
      s.manoeuvre = m;
      s.seed = common.seed + static_cast<std::uint64_t>(grids.size());
      grids.push_back(make_grid(model_true::fly(kTruth, s).record, options));
    }
  }
  FitProblem problem(const ModelValues& start, const std::vector<FreeParameter>& free) const {
    FitProblem p{.start = start, .free = free, .flights = {}, .noise = true_noise(), .flight_noise = {}, .flight_start = {}};
    for (const GridFlight& g : grids) p.flights.push_back(&g);
    return p;
  }
};

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
  double worst = 0, worst_u = 0;
  for (std::size_t i = 0; i < own.estimates.size(); ++i) {
    const Estimate &a = own.estimates[i], &b = ceres.estimates[i];
    EXPECT_EQ(a.parameter, b.parameter);
    EXPECT_EQ(a.flight, b.flight);
    worst = std::max(worst, std::fabs(b.value - a.value) / a.u);
    worst_u = std::max(worst_u, std::fabs(b.u / a.u - 1));
    EXPECT_NEAR((b.value - a.value) / a.u, 0.0, 1e-4) << parameter_info(a.parameter, own.values[0].terms).name << " in standard errors";
    EXPECT_NEAR(b.u / a.u, 1.0, 1e-6) << parameter_info(a.parameter, own.values[0].terms).name;
    EXPECT_NEAR(b.prior_share, a.prior_share, 1e-6);
  }
  const Eigen::VectorXd k = own.covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd difference = k.asDiagonal() * (ceres.covariance - own.covariance) * k.asDiagonal();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-6) << "of correlations";
  double worst_x = 0;
  for (std::size_t f = 0; f < own.states.size(); ++f) {
    for (std::size_t s = 0; s < own.states[f].size(); ++s)
      worst_x = std::max(worst_x, (own.states[f][s].p_W_m - ceres.states[f][s].p_W_m).norm());
  }
  std::printf("cost %.9g rel %.2e  est %.2e  u %.2e corr %.2e x %.2e iterations %d %d\n", own.cost, ceres.cost / own.cost - 1, worst,
              worst_u, difference.cwiseAbs().maxCoeff(), worst_x, own.iterations, ceres.iterations);
}

// Poses, gyro, accelerometer and velocity of one flight, with every 40th pose off by 0.1 m: what a tracking system does.
GridFlight flight_with_all_sensors(Manoeuvre manoeuvre, std::uint64_t seed, double duration_s) {
  FlightSettings s{.manoeuvre = manoeuvre, .seed = seed, .duration_s = duration_s, .imu_every_ms = 1};
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

TEST(IdentifyCeres, GivesTheSameFitOfPosesFromDifferentStarts) {
  const Flights flights({.duration_s = 2.0});
  const auto free = papers_parameters();
  const auto start = [&](double share) { return flights.problem(away_from(truth_values(), free, share), free); };
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
  FitProblem p{.start = start, .free = free, .flights = {&grids[0], &grids[1]}, .noise = {}, .flight_noise = {}, .flight_start = {}};
  p.flight_noise = {true_noise(), true_noise()};
  p.flight_noise[1].position_m = {3e-3, 2e-3, 4e-3};
  p.flight_start = {start.values, away_from(start, free, 0.01).values};
  const Fit own = fit(p, to_the_end(3.0));
  expect_same(own, fit_with_ceres(p, to_the_end(3.0)));
  EXPECT_GT(own.find(kPoseDelay, 0)->prior_share, 0.1) << "the prior counts";
  EXPECT_GT(std::fabs(fit(p, to_the_end()).find(kOffsetX)->value - own.find(kOffsetX)->value), own.find(kOffsetX)->u) << "so does the loss";
}

TEST(IdentifyCeres, GivesTheSameFitOfAModelWithAddedTermsAndALateRotorLogWithAGap) {
  host::TermList terms;
  terms.add(*host::find_term("rotor_local_inflow"));
  terms.add(*host::find_term("rotor_inertia_reaction"));
  model_true::Truth late = kTruth;
  late.rotor_delay_s = 0.004;
  model_true::ModelTrueFlight f = model_true::fly(late, {.manoeuvre = Manoeuvre::rotation, .seed = 9, .duration_s = 4.0});
  auto& speeds = f.record.rotor_omega_rad_s;
  for (std::size_t k = 2000; k < 2200; ++k) speeds.value[k].fill(std::nan(""));
  const GridFlight grid = make_grid(f.record, {});
  ASSERT_LT(std::count(grid.linked.begin(), grid.linked.end(), 1), static_cast<std::ptrdiff_t>(grid.knots) - 30) << "the chain is cut";
  const auto free = free_of({kIxx, kIyy, kIzz, kCq, kK1, kComX, kComY, kRotorDelay, kCoreParameters, kCoreParameters + 1});
  const FitProblem p{.start = away_from(truth_values(terms), free, 0.05),
                     .free = free,
                     .flights = {&grid},
                     .noise = true_noise(),
                     .flight_noise = {},
                     .flight_start = {}};
  const Fit own = fit(p, to_the_end());
  expect_same(own, fit_with_ceres(p, to_the_end()));
}

TEST(IdentifyCeres, GivesTheSameFitWithoutPosesFromMotorCommands) {
  // Gyro and accelerometer alone; speeds follow commands through a motor whose gain and lag are unknown.
  FlightSettings s{.manoeuvre = Manoeuvre::rotation, .seed = 12, .duration_s = 3.0, .imu_every_ms = 1};
  FlightRecord r = model_true::fly(kTruth, s).record;
  r.pose = {};
  for (std::size_t k = 0; k + 30 < r.rotor_omega_rad_s.size(); ++k) {  // a command that speeds answer 30 ms later
    RotorValues u = r.rotor_omega_rad_s.value[k + 30];
    for (double& v : u) v /= 2000.0;
    r.motor_command.add(r.rotor_omega_rad_s.t_s[k], u);
  }
  r.rotor_omega_rad_s = {};
  const GridFlight grid = make_grid(r, {.use_pose = false});
  ASSERT_GT(grid.anchor.norm(), 0.0);
  ModelValues start = truth_values();
  start[kCommandGain] = 2000.0;
  start[kCommandLag] = 0.03;
  const auto free = free_of({kIxx, kIyy, kIzz, kCommandGain, kCommandLag, kGyroBiasX, kGyroBiasY, kGyroBiasZ});
  const FitProblem p{.start = away_from(start, free, 0.05),
                     .free = free,
                     .flights = {&grid},
                     .noise = true_noise(),
                     .flight_noise = {},
                     .flight_start = {}};
  expect_same(fit(p, to_the_end()), fit_with_ceres(p, to_the_end()));
}

TEST(IdentifyCeres, RefusesWhatTheDataDoNotTell) {
  // Mass, inertia, thrust and torque coefficients scale together: no flight tells their common factor.
  const Flights flights({.duration_s = 1.5});
  FitProblem p = flights.problem(truth_values(), free_of({kMass, kIxx, kIyy, kIzz, kCq, kK1, kK2, kCdxy, kCdz}));
  for (const auto& solve : {&fit, &fit_with_ceres}) {
    try {
      solve(p, {}, {});
      FAIL() << "no error";
    } catch (const Error& e) {
      EXPECT_EQ(e.exit_code(), ExitCode::data_quality) << e.what();
    }
  }
}

TEST(IdentifyCeres, SaysThatItDoesNotEstimateTheNoise) {
  const Flights flights({.duration_s = 1.5});
  FitOptions o;
  o.noise.rounds = 5;
  try {
    fit_with_ceres(flights.problem(truth_values(), papers_parameters()), o);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::usage);
  }
}

}  // namespace
}  // namespace rotorloop::bench
