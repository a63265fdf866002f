// The elimination of one flight's states against the same normal equations solved densely, and what it says about its own noise.
#include "bench/sysid/estimate/chain.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::estimate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

host::VehicleModel guessed_vehicle() {
  host::VehicleModel m;
  m.mass_kg = 0.682;
  m.inertia_kg_m2 = {2.6e-3, 3.3e-3, 5.4e-3};
  const double l = 0.0885;
  m.rotors = {{{{l, -l, 0}, -1}, {{-l, l, 0}, -1}, {{l, l, 0}, 1}, {{-l, -l, 0}, 1}}};
  m.thrust = {3.0e-6, -1.5e-4, 0.0635, 1.2};
  m.c_q_N_m_s2 = 3e-8;
  m.drag = {0.017, 0.005, 0.018};
  m.pose_sensor_p_BS_m = {0.09, 0.006, 0.014};
  m.pose_sensor_q_BS = model_true::Truth{}.q_BS;
  return m;
}

const Columns kSome{kIxx, kK1, kCdh, kOffsetX, kTurnZ, kPoseDelay, kGyroBiasX, kAccelBiasZ};

// 1.2 s of the rotation flight with every kind of measurement, cut in the middle.
struct Short {
  model_true::ModelTrueFlight flight;
  GridFlight grid;
  ModelValues values = model_values(guessed_vehicle());
  NoiseModel noise;
  std::vector<BodyState> states, guess;

  Short() : flight(fly()), grid(make_grid(flight.record, options())) {
    noise.gyro_rad_s.setConstant(0.01);
    noise.accel_m_s2 = {0.2, 0.3, 0.4};
    noise.position_m = {2e-3, 3e-3, 4e-3};
    states = guess = guess_states(grid, values);
    grid.linked[30] = 0;
  }
  static model_true::ModelTrueFlight fly() {
    model_true::FlightSettings s;
    s.manoeuvre = model_true::Manoeuvre::rotation;
    s.duration_s = 1.2;
    s.imu_every_ms = 2;
    return model_true::fly({}, s);
  }
  static GridOptions options() {
    GridOptions o;
    o.rate_Hz = 50.0;
    o.use_gyro = o.use_accel = true;
    return o;
  }
};

// All residuals as one dense system: unknowns are the states in order, then the columns.
struct Dense {
  MatrixXd h;
  VectorXd g;
  double cost = 0.0;

  Dense(const Short& s, const Residuals& res) {
    const auto p = static_cast<Eigen::Index>(kSome.size()), n = 12 * static_cast<Eigen::Index>(s.grid.nodes);
    h = MatrixXd::Zero(n + p, n + p);
    g = VectorXd::Zero(n + p);
    const auto add = [&](std::size_t node, const auto& state, const auto& columns, const auto& r, const StateJacobian* next = nullptr) {
      MatrixXd j = MatrixXd::Zero(r.size(), n + p);
      j.middleCols(12 * static_cast<Eigen::Index>(node), 12) = state;
      if (next) j.middleCols(12 * static_cast<Eigen::Index>(node + 1), 12) = *next;
      j.rightCols(p) = columns;
      h += j.transpose() * j;
      g += j.transpose() * r;
      cost += 0.5 * r.squaredNorm();
    };
    RowsBy<6> six;
    RowsBy<3> three;
    ProcessRows step;
    for (const PoseFix& f : s.grid.pose) {
      res.pose(f, s.states[f.node], six, true);
      add(f.node, six.state, six.columns, six.r);
    }
    for (const VectorFix& f : s.grid.gyro) {
      res.gyro(f, s.states[f.node], three, true);
      add(f.node, three.state, three.columns, three.r);
    }
    for (const VectorFix& f : s.grid.accel) {
      res.accel(f, s.states[f.node], three, true);
      add(f.node, three.state, three.columns, three.r);
    }
    for (std::size_t k = 0; k + 1 < s.grid.nodes; ++k) {
      if (!s.grid.linked[k]) continue;
      res.process(k, s.states[k], s.states[k + 1], step);
      add(k, step.from, step.columns, step.r, &step.to);
    }
  }
};

TEST(Chain, ReducedSystemLogDeterminantCostAndStepsAreThoseOfTheDenseNormalEquations) {
  Short s;
  const Residuals res(s.grid, s.values, s.noise, kSome);
  const Dense dense(s, res);
  const auto n = 12 * static_cast<Eigen::Index>(s.grid.nodes), p = static_cast<Eigen::Index>(kSome.size());
  const MatrixXd states = dense.h.topLeftCorner(n, n), arrow = dense.h.topRightCorner(n, p);
  const Eigen::LLT<MatrixXd> llt(states);
  const MatrixXd reduced = dense.h.bottomRightCorner(p, p) - arrow.transpose() * llt.solve(arrow);
  const VectorXd score = dense.g.tail(p) - arrow.transpose() * llt.solve(dense.g.head(n));

  Chain chain(s.grid, s.states, s.guess);
  const Reduced r = chain.sweep(res, {});
  for (Eigen::Index i = 0; i < p; ++i) {
    const double scale = std::sqrt(reduced(i, i));
    EXPECT_NEAR(r.score[i] / scale, score[i] / scale, 1e-6 * (1.0 + std::fabs(score[i] / scale))) << i;
    for (Eigen::Index j = 0; j < p; ++j)
      EXPECT_NEAR(r.information(i, j) / (scale * std::sqrt(reduced(j, j))), reduced(i, j) / (scale * std::sqrt(reduced(j, j))), 1e-7);
  }
  const MatrixXd l = llt.matrixL();
  EXPECT_NEAR(r.log_det_states, 2.0 * l.diagonal().array().log().sum(), 1e-7 * std::fabs(r.log_det_states));
  EXPECT_NEAR(r.cost, dense.cost, 1e-9 * dense.cost);
  EXPECT_NEAR(chain.cost(res, 0.0), dense.cost, 1e-9 * dense.cost);

  const VectorXd parameter_step = -1e-3 * reduced.diagonal().cwiseSqrt().cwiseInverse();
  const VectorXd step = -llt.solve(dense.g.head(n) + arrow * parameter_step);
  const std::vector<BodyState> before = s.states;
  chain.apply(parameter_step, 1.0);
  for (std::size_t k = 0; k < before.size(); ++k) {
    const StateError expected = step.segment<12>(12 * static_cast<Eigen::Index>(k));
    EXPECT_LT((difference(before[k], s.states[k]) - expected).norm(), 1e-6 * (1e-3 + expected.norm())) << "node " << k;
  }
}

TEST(RowSmoother, MovesAndNoiseMomentsUnderAnotherNoiseAreThoseOfTheDenseNormalEquationsWithIt) {
  Short s;
  NoiseModel other = s.noise;
  other.force_m_s2_rtHz = {0.02, 0.09, 0.05};
  other.angular_rad_s2_rtHz.setConstant(1.1);
  other.position_m *= 1.7;
  other.attitude_rad = {1e-3, 2e-3, 5e-3};
  other.gyro_rad_s.setConstant(0.03);
  other.accel_m_s2 = {0.5, 0.2, 0.1};
  const Residuals res(s.grid, s.values, s.noise, kSome), res_other(s.grid, s.values, other, kSome);
  const Dense dense(s, res_other);
  const auto n = 12 * static_cast<Eigen::Index>(s.grid.nodes);
  const Eigen::LLT<MatrixXd> llt(dense.h.topLeftCorner(n, n));
  const VectorXd move = -llt.solve(dense.g.head(n));
  const MatrixXd covariance = llt.solve(MatrixXd::Identity(n, n));
  const auto at = [](std::size_t node) { return 12 * static_cast<Eigen::Index>(node); };

  Chain chain(s.grid, s.states, s.guess);
  chain.sweep(res, {.keep_rows = true});
  RowSmoother smoother(s.grid, chain.rows_here(res), s.noise);
  const NoiseMoments found = smoother.smooth(other);

  for (std::size_t k = 0; k < s.grid.nodes; ++k) {
    const StateError expected = move.segment<12>(at(k));
    EXPECT_LT((smoother.moves()[k] - expected).norm(), 1e-6 * (1e-6 + expected.norm())) << "node " << k;
  }
  RowsBy<3> three;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();
  for (const VectorFix& f : s.grid.gyro) {
    res_other.gyro(f, s.states[f.node], three, true);
    gyro += (three.r + three.state * move.segment<12>(at(f.node))).cwiseAbs2();
    gyro += (three.state * covariance.block<12, 12>(at(f.node), at(f.node)) * three.state.transpose()).diagonal();
  }
  EXPECT_LT((found.gyro.squares - gyro).norm(), 1e-6 * gyro.norm());
  EXPECT_EQ(found.gyro.count, static_cast<double>(s.grid.gyro.size()));

  ProcessRows step;
  Eigen::Matrix<double, 12, 1> process = Eigen::Matrix<double, 12, 1>::Zero();
  for (std::size_t k = 0; k + 1 < s.grid.nodes; ++k) {
    if (!s.grid.linked[k]) continue;
    res_other.process(k, s.states[k], s.states[k + 1], step);
    Eigen::Matrix<double, 12, 24> both;
    both << step.from, step.to;
    process += (step.r + both * move.segment<24>(at(k))).cwiseAbs2();
    process += (both * covariance.block<24, 24>(at(k), at(k)) * both.transpose()).diagonal();
  }
  const Eigen::Vector3d force = 0.5 * (process.segment<3>(0) + process.segment<3>(3)),
                        angular = 0.5 * (process.segment<3>(6) + process.segment<3>(9));
  EXPECT_LT((found.force.squares - force).norm(), 1e-6 * force.norm());
  EXPECT_LT((found.angular.squares - angular).norm(), 1e-6 * angular.norm());
}

TEST(Chain, RowsHereHaveTheResidualsOfStatesThatMovedSinceTheSweep) {
  Short s;
  const Residuals res(s.grid, s.values, s.noise, kSome);
  Chain chain(s.grid, s.states, s.guess);
  chain.sweep(res, {.keep_rows = true});
  chain.move(std::vector<StateError>(s.grid.nodes, StateError::Constant(1e-3)));
  const LinearRows& rows = chain.rows_here(res);
  RowsBy<6> six;
  RowsBy<3> three;
  res.pose(s.grid.pose[7], s.states[s.grid.pose[7].node], six, false);
  res.accel(s.grid.accel[5], s.states[s.grid.accel[5].node], three, false);
  EXPECT_EQ(rows.pose[7].r, six.r);
  EXPECT_EQ(rows.accel[5].r, three.r);
  EXPECT_EQ(rows.steps[3].r, res.process(3, s.states[3], s.states[4]));
}

TEST(Chain, ScoreBlocksAddUpToTheWholeFlight) {
  Short s;
  const Residuals res(s.grid, s.values, s.noise, kSome);
  Chain chain(s.grid, s.states, s.guess);
  SweepOptions o;
  o.block_s = 0.25;
  const Reduced r = chain.sweep(res, o);
  EXPECT_GE(r.blocks.size(), 4u);
  MatrixXd information = MatrixXd::Zero(r.information.rows(), r.information.cols());
  VectorXd score = VectorXd::Zero(r.score.size());
  for (const ScoreBlock& b : r.blocks) {
    information += b.information;
    score += b.score;
    // A block can only add information.
    const VectorXd scale = r.information.diagonal().cwiseSqrt().cwiseInverse();
    const MatrixXd scaled = scale.asDiagonal() * b.information * scale.asDiagonal();
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixXd>(scaled).eigenvalues()[0], -1e-6);
  }
  EXPECT_LT((information - r.information).norm(), 1e-8 * r.information.norm());
  EXPECT_LT((score - r.score).norm(), 1e-8 * r.score.norm());
}

// Central differences of every measurement's residuals by state and columns, `v` with what a test sets. Gyro, accelerometer and velocity
// are read `late_s` behind their node.
void expect_derivatives_of_differences(const Short& s, ModelValues v, Columns columns, double late_s = 0.0) {
  v[kPoseDelay] = 2e-3;
  v[kTurnX] = 0.05;
  v[kImuX] = 0.02;
  v[kImuZ] = -0.03;
  for (const int p :
       {kOffsetX, kOffsetY, kOffsetZ, kTurnX, kTurnY, kTurnZ, kPoseDelay, kGyroBiasY, kAccelBiasX, kImuX, kImuY, kImuZ, kK1, kIyy, kMass})
    columns.push_back(p);
  const Residuals res(s.grid, v, s.noise, columns);
  BodyState x = s.states[40];
  x.v_W_m_s = {3, -2, 1};
  x.w_B_rad_s = {2, -4, 3};
  VectorFix velocity{40, late_s, {3.1, -2.1, 0.9}};
  PoseFix pose = s.grid.pose[40];
  pose.late_s = 3e-3;
  VectorFix gyro = s.grid.gyro[40], accel = s.grid.accel[40];
  gyro.late_s = accel.late_s = late_s;
  const auto all = [&](const Residuals& r, const BodyState& at) {
    RowsBy<6> six;
    RowsBy<3> a, b, c;
    r.pose(pose, at, six, false);
    r.velocity(velocity, at, a, false);
    r.gyro(gyro, at, b, false);
    r.accel(accel, at, c, false);
    Eigen::Matrix<double, 15, 1> out;
    out << six.r, a.r, b.r, c.r;
    return out;
  };
  RowsBy<6> six;
  RowsBy<3> a, b, c;
  res.pose(pose, x, six, true);
  res.velocity(velocity, x, a, true);
  res.gyro(gyro, x, b, true);
  res.accel(accel, x, c, true);
  Eigen::Matrix<double, 15, 12> state;
  state << six.state, a.state, b.state, c.state;
  MatrixXd by(15, static_cast<Eigen::Index>(columns.size()));
  by << six.columns, a.columns, b.columns, c.columns;
  for (int i = 0; i < 12; ++i) {
    const StateError d = 1e-6 * StateError::Unit(i);
    const VectorXd slope = (all(res, moved(x, d)) - all(res, moved(x, -d))) / 2e-6;
    EXPECT_LT((slope - state.col(i)).norm(), 1e-5 * (1.0 + slope.norm())) << "state direction " << i;
  }
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const double e = 1e-3 * parameter_info(columns[k], v.terms).scale;
    ModelValues up = v, down = v;
    up[columns[k]] += e;
    down[columns[k]] -= e;
    const VectorXd slope = (all(Residuals(s.grid, up, s.noise, columns), x) - all(Residuals(s.grid, down, s.noise, columns), x)) / (2 * e);
    EXPECT_LT((slope - by.col(static_cast<Eigen::Index>(k))).norm(), 1e-4 * slope.norm()) << parameter_info(columns[k], v.terms).name;
  }
}

TEST(Residuals, OfEveryMeasurementHaveTheDerivativesOfDifferences) {
  const Short s;
  expect_derivatives_of_differences(s, s.values, {});
}

TEST(Residuals, OfMeansThatStand5msBeforeOr4msBehindTheirNodeHaveTheDerivativesOfDifferences) {
  const Short s;
  for (const double late_s : {-5e-3, 4e-3}) expect_derivatives_of_differences(s, s.values, {}, late_s);
}

TEST(Residuals, OfASensorWhoseScaleIs2percentOffHaveTheDerivativesOfDifferences) {
  const Short s;
  host::TermList terms;
  terms.add(*host::find_term("pose_scale"));
  ModelValues v = model_values(guessed_vehicle(), terms);
  v[kCoreParameters] = 0.02;
  expect_derivatives_of_differences(s, v, {kCoreParameters});
}

TEST(Residuals, OfAnImuTurnedBy2And3DegreesAndScaledBy3percentHaveTheDerivativesOfDifferences) {
  const Short s;
  host::TermList terms;
  std::vector<int> columns;
  for (const char* id : {"imu_rotation", "gyro_scale", "accel_scale"}) terms.add(*host::find_term(id));
  ModelValues v = model_values(guessed_vehicle(), terms);
  const double values[] = {0.035, -0.05, 0.02, 0.03, 0.02, -0.01, -0.02, 0.01, 0.03};
  for (int k = 0; k < 9; ++k) {
    v[kCoreParameters + k] = values[k];
    columns.push_back(kCoreParameters + k);
  }
  for (const double late_s : {0.0, 4e-3}) expect_derivatives_of_differences(s, v, columns, late_s);
}

}  // namespace
}  // namespace rotorloop::estimate
