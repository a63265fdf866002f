// The own elimination and Ceres, on the same problems: both give the same cost, the same estimates and the same standard errors.
// They share the residuals and their derivatives; retraction, factorisation, damping, stopping and covariance are each their own.
#include "bench/identify/ceres_solver.hpp"

#include <gtest/gtest.h>

#include <cmath>

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
  return free_of({kIxx, kIyy, kIzz, kCq, kComX, kComY, kK1, kK2, kCdh, kCdxy, kCdz, kOffsetX, kOffsetY, kOffsetZ, kTurnX, kTurnY, kTurnZ,
                  kPoseDelay});
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
    for (std::size_t s = 0; s < own.states[f].size(); ++s) worst_x = std::max(worst_x, (own.states[f][s].p_W_m - ceres.states[f][s].p_W_m).norm());
  }
  std::printf("cost %.9g rel %.2e  est %.2e  u %.2e corr %.2e x %.2e iterations %d %d\n", own.cost, ceres.cost / own.cost - 1, worst, worst_u,
              difference.cwiseAbs().maxCoeff(), worst_x, own.iterations, ceres.iterations);
}

TEST(IdentifyCeres, GivesTheSameFitOfPosesFromDifferentStarts) {
  const Flights flights({.duration_s = 3.0});
  const auto free = papers_parameters();
  const auto start = [&](double share) { return flights.problem(away_from(truth_values(), free, share), free); };
  const Fit own = fit(start(0.05), to_the_end());
  expect_same(own, fit_with_ceres(start(0.05), to_the_end()));
  expect_same(own, fit_with_ceres(start(-0.1), to_the_end()));
  expect_same(fit(start(-0.1), to_the_end()), fit_with_ceres(start(0.0), to_the_end()));
}

}  // namespace
}  // namespace rotorloop::bench
