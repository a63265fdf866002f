// Agreement between flights, on flights that are nothing but their information and score: the level when they agree, the name of the
// parameter when one moved.
#include "bench/sysid/identify/homogeneity.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "host/base/random.hpp"

namespace rotorloop::identify {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Four shared parameters seen by flights with different information; `moved`: shift of one parameter in the last flight, in its own
// standard uncertainties. Scores are those of a joint optimum.
struct Made {
  estimate::FitProblem problem;
  estimate::Fit fit;
};
Made made(std::uint64_t seed, int flights, int moved_parameter = -1, double moved_by_u = 0.0) {
  constexpr int kParameters[] = {estimate::kIxx, estimate::kCq, estimate::kK1, estimate::kCdh};
  const RandomStream random(seed, 5);
  std::uint64_t k = 0;
  Made m;
  for (const int p : kParameters) m.problem.free.push_back({p, false, 0.0});
  MatrixXd total = MatrixXd::Zero(4, 4);
  VectorXd weighted = VectorXd::Zero(4);
  std::vector<MatrixXd> s;
  std::vector<VectorXd> own;
  for (int f = 0; f < flights; ++f) {
    MatrixXd a(4, 8);
    for (Eigen::Index i = 0; i < a.size(); ++i) a.data()[i] = random.gaussian(k++);
    s.push_back(a * a.transpose());
    const Eigen::LLT<MatrixXd> llt(s.back().inverse());
    VectorXd draw(4);
    for (Eigen::Index i = 0; i < 4; ++i) draw[i] = random.gaussian(k++);
    own.push_back(llt.matrixL() * draw);
    if (f == flights - 1 && moved_parameter >= 0)
      own.back()[moved_parameter] += moved_by_u * std::sqrt(s.back().inverse()(moved_parameter, moved_parameter));
    total += s.back();
    weighted += s.back() * own.back();
  }
  const VectorXd joint = total.llt().solve(weighted);
  for (int f = 0; f < flights; ++f) {
    estimate::Reduced r;
    r.information = s[static_cast<std::size_t>(f)];
    r.score = r.information * (joint - own[static_cast<std::size_t>(f)]);  // gradient of ½(θ - θ_f)ᵀS(θ - θ_f) at the joint optimum
    m.fit.reduced.push_back(r);
  }
  for (Eigen::Index i = 0; i < 4; ++i) m.fit.estimates.push_back({.parameter = kParameters[i], .flight = -1, .value = joint[i]});
  m.fit.covariance = total.inverse();
  return m;
}

Homogeneity of(const Made& m) { return homogeneity_of(m.problem, m.fit); }

TEST(Homogeneity, RejectsFivePercentOfFlightsThatAgree) {
  int rejected = 0, parameter_moved = 0;
  double chi2 = 0.0;
  for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
    const Homogeneity h = of(made(seed, 4));
    rejected += h.p < 0.05;
    chi2 += h.chi2 / h.degrees / 1000.0;
    for (const auto& p : h.parameters) parameter_moved += p.moved;
  }
  EXPECT_NEAR(rejected / 1000.0, 0.05, 0.02);
  EXPECT_NEAR(chi2, 1.0, 0.04);
  EXPECT_LE(parameter_moved, 20) << "level 1 % for all parameters of a fit together";
}

TEST(Homogeneity, NamesTheParameterThatMovedByEightOfItsUncertainties) {
  int found = 0, others = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const Homogeneity h = of(made(seed, 3, 2, 8.0));
    for (const auto& p : h.parameters) (p.parameter == estimate::kK1 ? found : others) += p.moved;
  }
  EXPECT_GE(found, 95);
  EXPECT_LE(others, 5);
}

TEST(Homogeneity, GivesEachFlightsOwnEstimate) {
  const Made m = made(3, 3, 1, 30.0);
  const Homogeneity h = of(m);
  const ParameterHomogeneity& cq = h.parameters[1];
  EXPECT_GT((cq.value[2] - cq.value[0]) / cq.u[2], 15.0);
  EXPECT_NEAR(cq.u[2], std::sqrt(m.fit.reduced[2].information.inverse()(1, 1)), 1e-9);
}

TEST(Homogeneity, LeavesOutAFlightThatCannotTellAParameter) {
  Made m = made(3, 3);
  m.fit.reduced[0].information.row(3).setZero();
  m.fit.reduced[0].information.col(3).setZero();
  m.fit.reduced[0].score[3] = 0.0;
  const Homogeneity h = of(m);
  EXPECT_TRUE(std::isinf(h.parameters[3].u[0]));
  EXPECT_DOUBLE_EQ(h.parameters[3].degrees, 1.0);
  EXPECT_NEAR(h.degrees, 7.0, 0.5);
}

TEST(Homogeneity, SaysNothingOfASingleFlight) { EXPECT_DOUBLE_EQ(of(made(1, 1)).degrees, 0.0); }

}  // namespace
}  // namespace rotorloop::identify
