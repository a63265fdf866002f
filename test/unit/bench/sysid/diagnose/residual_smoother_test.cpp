// The smoother as a linear machine: the fit's own residuals stay where they are, its covariances are those of noise that is known, and
// a wrench put in comes out again where the measurements can see it.
#include "bench/sysid/diagnose/residuals/residual_smoother.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "bench/sysid/estimate/chain.hpp"
#include "host/base/random.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::diagnose {
namespace {

estimate::GridFlight two_seconds() {
  model_true::FlightSettings s;
  s.manoeuvre = model_true::Manoeuvre::rotation;
  s.duration_s = 2.0;
  s.imu_every_ms = 2;
  estimate::GridOptions o;
  o.rate_Hz = 100.0;
  o.use_gyro = true;
  estimate::GridFlight g = make_grid(model_true::fly({}, s).record, o);
  g.linked[60] = 0;
  return g;
}

estimate::ModelValues true_values() {
  host::VehicleModel m;
  const model_true::Truth truth;
  m.mass_kg = 0.682;
  m.inertia_kg_m2 = truth.inertia_kg_m2;
  const double l = 0.0885;
  m.rotors = {{{{l, -l, 0}, -1}, {{-l, l, 0}, -1}, {{l, l, 0}, 1}, {{-l, -l, 0}, 1}}};
  m.thrust = {truth.k1_N_s2, truth.k2_N_s2_m, 0.0635, 1.2};
  m.c_q_N_m_s2 = truth.c_q_N_m_s2;
  m.pose_sensor_p_BS_m = {0.09, 0.006, 0.014};
  m.pose_sensor_q_BS = truth.q_BS;
  return estimate::model_values(m);
}

struct Short {
  estimate::GridFlight grid = two_seconds();
  estimate::ModelValues values = true_values();
  estimate::NoiseModel noise;
  std::vector<estimate::BodyState> states;
  LinearFlight linear;

  Short() {
    noise.force_m_s2_rtHz.setConstant(0.03);
    noise.angular_rad_s2_rtHz.setConstant(0.3);
    noise.gyro_rad_s.setConstant(0.01);
    states = estimate::guess_states(grid, values);
    const std::vector<estimate::BodyState> guess = states;
    const estimate::Residuals res(grid, values, noise, {});
    estimate::Chain chain(grid, states, guess);
    for (int i = 0; i < 6; ++i) {
      chain.sweep(res, {});
      chain.apply(Eigen::VectorXd(0), 1.0);
    }
    linear = linearised(grid, values, noise, states);
  }
};

TEST(ResidualSmoother, LeavesTheResidualsOfAFitAtItsOptimumWhereTheyAre) {
  const Short s;
  ResidualColumns in = ResidualColumns::zero(s.linear, 1);
  for (std::size_t k = 0; k < s.linear.steps.size(); ++k) in.step(k) = s.linear.steps[k].r;
  for (std::size_t i = 0; i < s.linear.measurements.size(); ++i) in.measurement(i) = s.linear.measurements[i].r;
  const ResidualColumns out = ResidualSmoother(s.linear, 1.0).smoothed(in);
  EXPECT_LT((out.steps - in.steps).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((out.measurements - in.measurements).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_GT(in.measurements.cwiseAbs().maxCoeff(), 1.0) << "there is something to leave";
}

TEST(ResidualSmoother, ErrsByItsOwnCovariancesOnNoiseThatIsKnown) {
  const Short s;
  constexpr Eigen::Index kDrawn = 200;
  const RandomStream random(3, 7);
  std::uint64_t n = 0;
  ResidualColumns in = ResidualColumns::zero(s.linear, kDrawn);
  for (std::size_t k = 0; k < s.linear.steps.size(); ++k) {
    if (!s.linear.linked[k]) continue;
    in.step(k) = Eigen::MatrixXd::NullaryExpr(12, kDrawn, [&] { return random.gaussian(n++); });
  }
  for (std::size_t i = 0; i < s.linear.measurements.size(); ++i)
    in.measurement(i).topRows(s.linear.measurements[i].rows) =
        Eigen::MatrixXd::NullaryExpr(s.linear.measurements[i].rows, kDrawn, [&] { return random.gaussian(n++); });
  const ResidualSmoother own(s.linear, 1.0);
  const ResidualColumns out = own.smoothed(in);
  double ratio = 0.0, numbers = 0.0;
  own.covariances([&](std::size_t k, const estimate::StateJacobian& c) {
    const Eigen::MatrixXd error = out.step(k) - in.step(k);
    for (Eigen::Index i = 0; i < 12; ++i) {
      const double scatter = error.row(i).squaredNorm() / kDrawn;
      EXPECT_NEAR(scatter / c(i, i), 1.0, 0.5) << "row " << i << " of step " << k;  // five deviations of 200 draws
      EXPECT_LE(c(i, i), 1.0 + 1e-9) << "never worse than the prior";
      ratio += scatter / c(i, i);
      numbers += 1.0;
    }
  });
  EXPECT_NEAR(ratio / numbers, 1.0, 0.02);
}

TEST(ResidualSmoother, GivesBackAConstantTorqueAlmostWholeWhenTheMeasurementsDecideAndLittleOfItWhenTheNoiseIsSmall) {
  const Short s;
  const Eigen::Vector3d torque_N_m(0.0, 0.01, 0.0);
  const estimate::StateJacobian unwhiten = s.linear.whitening.inverse();
  ResidualColumns in = ResidualColumns::zero(s.linear, 1);
  const double h = s.grid.step_s;
  const Eigen::Vector3d turn = h * (s.values.inertia_kg_m2().inverse() * torque_N_m);
  for (std::size_t k = 0; k < s.linear.steps.size(); ++k) {
    if (!s.linear.linked[k]) continue;
    estimate::StateError e = estimate::StateError::Zero();
    e.segment<3>(6) = 0.5 * h * turn;
    e.segment<3>(9) = turn;
    in.step(k) = s.linear.whitening * e;
  }
  const auto in_the_middle = [&](double scale) {
    const ResidualColumns out = ResidualSmoother(s.linear, scale).smoothed(in);
    return unwhiten.row(10).dot(out.step(140).col(0)) / turn.y();
  };
  EXPECT_NEAR(in_the_middle(100.0), 1.0, 0.02);
  EXPECT_LT(in_the_middle(1e-6), 0.1);
}

}  // namespace
}  // namespace rotorloop::diagnose
