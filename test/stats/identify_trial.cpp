// Flights, start values, fit, derived quantities.
#include "test/stats/identify_trial.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>

#include "bench/sysid/estimate/estimator.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/base/random.hpp"
#include "test/support/model_true_vehicle.hpp"

namespace rotorloop::stats {
namespace {

using estimate::ModelValues;
using model_true::Truth;

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr double kDragSpeed_m_s = 8.5;

// The time offset is estimated as one of the rotor log, so that the nodes lie where the poses were taken; see
// docs/acceptance/identify_monte_carlo.md for what happens otherwise. The last of the list.
const std::vector<int> kFree{estimate::kIxx,   estimate::kIyy,     estimate::kIzz,       estimate::kCq,      estimate::kComX,
                             estimate::kComY,  estimate::kK1,      estimate::kK2,        estimate::kCdh,     estimate::kCdxy,
                             estimate::kCdz,   estimate::kOffsetX, estimate::kOffsetY,   estimate::kOffsetZ, estimate::kTurnX,
                             estimate::kTurnY, estimate::kTurnZ,   estimate::kRotorDelay};

// Of eq. 1 and 2 at rest, N s²; see model_true::static_thrust_coefficient.
double static_thrust(const estimate::ModelValues& v) {
  Truth t;
  t.k1_N_s2 = v[estimate::kK1];
  t.k2_N_s2_m = v[estimate::kK2];
  return model_true::static_thrust_coefficient(t);
}
// Both drags at 8.5 m/s level with the thrust of hover, N.
double drag(const estimate::ModelValues& v) {
  return v[estimate::kMass] * model_true::kGravity_m_s2 * v[estimate::kCdh] * kDragSpeed_m_s +
         v[estimate::kCdxy] * kDragSpeed_m_s * kDragSpeed_m_s;
}

// Values that a user might begin with: right in order of magnitude, wrong by tens of percent; another guess for every seed.
estimate::ModelValues first_guess(const Truth& truth, std::uint64_t seed) {
  estimate::ModelValues v = estimate::model_values(model_true::vehicle_of(truth));
  const RandomStream random(seed, 0x67756573ull);
  std::uint64_t n = 0;
  const auto between = [&](double a, double b) { return a + (b - a) * random.uniform(n++); };
  for (const int p : {estimate::kIxx, estimate::kIyy, estimate::kIzz, estimate::kCq}) v[p] *= between(0.7, 1.4);
  v[estimate::kK1] *= between(0.8, 1.2);
  v[estimate::kK2] *= between(0.5, 1.5);
  for (const int p : {estimate::kCdh, estimate::kCdxy, estimate::kCdz}) v[p] *= between(0.3, 2.0);
  v[estimate::kComX] = v[estimate::kComY] = 0.0;
  for (const int p : {estimate::kOffsetX, estimate::kOffsetY, estimate::kOffsetZ}) v[p] += between(-0.02, 0.02);
  v.start_q_BS = v.start_q_BS * model_true::exponential({between(-0.08, 0.08), between(-0.08, 0.08), between(-0.08, 0.08)});
  return v;
}

double rms(const Eigen::Vector3d& v) { return v.norm() / std::sqrt(3.0); }

}  // namespace

std::vector<Quantity> quantities(const Truth& t) {
  const auto percent = [](const char* name, const char* unit, double truth, double limit_percent) {
    return Quantity{name, unit, truth, limit_percent / 100.0, true};
  };
  std::vector<Quantity> q{
      percent("I_xx", "kg m2", t.inertia_kg_m2.x(), 1),
      percent("I_yy", "kg m2", t.inertia_kg_m2.y(), 1),
      percent("I_zz", "kg m2", t.inertia_kg_m2.z(), 1),
      percent("c_q", "N m s2", t.c_q_N_m_s2, 2),
      {"com_x", "m", t.com_offset_m.x()},
      {"com_y", "m", t.com_offset_m.y()},
      percent("k1", "N s2", t.k1_N_s2, 0),
      percent("k2", "N s2/m", t.k2_N_s2_m, 0),
      percent("c_dh", "s/m", t.c_dh_s_m, 5),
      percent("c_dxy", "N s2/m2", t.c_dxy_N_s2_m2, 22),
      percent("c_dz", "N s2/m2", t.c_dz_N_s2_m2, 13),
      {"r_BS_x", "m", t.r_BS_m.x(), 1e-3},
      {"r_BS_y", "m", t.r_BS_m.y(), 1e-3},
      {"r_BS_z", "m", t.r_BS_m.z(), 1e-3},
      {"q_BS_x", "rad", 0.0, 0.2 * kDegree},
      {"q_BS_y", "rad", 0.0, 0.2 * kDegree},
      {"q_BS_z", "rad", 0.0, 0.2 * kDegree},
      {"rotor_delay", "s", t.rotor_delay_s - t.pose_delay_s, 0.5e-3},
  };
  estimate::ModelValues v = estimate::model_values(model_true::vehicle_of(t));
  q.push_back({"static c_t", "N s2", static_thrust(v), 0.01, true, false});
  q.push_back({"drag at 8.5 m/s", "N", drag(v), 0.03, true, false});
  return q;
}

Truth study_truth() {
  Truth t;
  t.pose_delay_s = 0.002;
  return t;
}

Trial run_trial(const TrialSettings& s) {
  const Truth truth = study_truth();
  model_true::FlightSettings flown;
  flown.seed = s.seed;
  flown.duration_s = s.duration_s;
  flown.rotor_log_every_ms = s.rotor_log_every_ms;
  flown.pilot_sees_truth = s.pilot_sees_truth;
  model_true::FlightSettings really = flown;
  if (s.quiet) really.q_a_m_s2_rtHz = really.q_alpha_rad_s2_rtHz = really.pose_sigma_m = really.pose_sigma_rad = 0.0;
  const auto flights = model_true::fly_identification_set(truth, really);

  std::vector<estimate::GridFlight> grids;
  for (const auto& f : flights) grids.push_back(estimate::make_grid(f.record, {}));
  estimate::FitProblem problem;
  problem.start = first_guess(truth, s.seed);
  for (const int p : kFree) problem.free.push_back({.parameter = p});
  if (s.nodes_at_stamps) problem.free.back().parameter = estimate::kPoseDelay;
  for (const auto& g : grids) problem.flights.push_back(&g);
  estimate::FitOptions options;
  if (s.estimate_noise) {
    options.noise = {.rounds = 10, .per_axis = false};
  } else {
    problem.noise.force_m_s2_rtHz.setConstant(flown.q_a_m_s2_rtHz);
    problem.noise.angular_rad_s2_rtHz.setConstant(flown.q_alpha_rad_s2_rtHz);
    problem.noise.position_m.setConstant(flown.pose_sigma_m);
    problem.noise.attitude_rad.setConstant(flown.pose_sigma_rad);
  }
  const estimate::Fit fit = estimate::fit(problem, options);
  const estimate::ModelValues& v = fit.values.front();

  Trial out;
  out.seed = s.seed;
  out.converged = fit.converged;
  out.iterations = fit.iterations;
  out.cost_per_dof = 2.0 * fit.cost / fit.degrees_of_freedom;
  out.q_a_m_s2_rtHz = rms(fit.noise.front().force_m_s2_rtHz);
  out.q_alpha_rad_s2_rtHz = rms(fit.noise.front().angular_rad_s2_rtHz);
  out.pose_sigma_m = rms(fit.noise.front().position_m);
  out.pose_sigma_rad = rms(fit.noise.front().attitude_rad);
  for (const estimate::Estimate& e : fit.estimates) out.outcomes.push_back({e.value, e.u, e.u_robust});
  if (s.nodes_at_stamps) out.outcomes.back().estimate *= -1.0;  // poses stamped late are rotor speeds stamped early

  // The sensor's rotation as the turn from the true one to the estimate, small; its covariance moved there from the fit's own turn.
  const auto turn_at = static_cast<Eigen::Index>(std::find(kFree.begin(), kFree.end(), int{estimate::kTurnX}) - kFree.begin());
  const auto turn_error = [&](const Eigen::Vector3d& turn) {
    return estimate::log_q(truth.q_BS.conjugate() * problem.start.start_q_BS * estimate::exp_q(turn));
  };
  const Eigen::Vector3d turn(v[estimate::kTurnX], v[estimate::kTurnY], v[estimate::kTurnZ]), error = turn_error(turn);
  Eigen::Matrix3d by;
  for (int i = 0; i < 3; ++i) by.col(i) = (turn_error(turn + 1e-6 * Eigen::Vector3d::Unit(i)) - error) / 1e-6;
  const Eigen::Matrix3d c = by * fit.covariance.block<3, 3>(turn_at, turn_at) * by.transpose();
  const Eigen::Matrix3d r = by * fit.robust_covariance.block<3, 3>(turn_at, turn_at) * by.transpose();
  for (int i = 0; i < 3; ++i) out.outcomes[static_cast<std::size_t>(turn_at + i)] = {error[i], std::sqrt(c(i, i)), std::sqrt(r(i, i))};

  // Derived numbers with standard errors by their gradients.
  for (const std::function<double(const estimate::ModelValues&)> f : {&static_thrust, &drag}) {
    Eigen::VectorXd gradient(static_cast<Eigen::Index>(kFree.size()));
    for (std::size_t i = 0; i < kFree.size(); ++i) {
      estimate::ModelValues up = v, down = v;
      const double e = 1e-5 * estimate::parameter_info(kFree[i], {}).scale;
      up[kFree[i]] += e;
      down[kFree[i]] -= e;
      gradient[static_cast<Eigen::Index>(i)] = (f(up) - f(down)) / (2 * e);
    }
    out.outcomes.push_back(
        {f(v), std::sqrt(gradient.dot(fit.covariance * gradient)), std::sqrt(gradient.dot(fit.robust_covariance * gradient))});
  }
  return out;
}

}  // namespace rotorloop::stats
