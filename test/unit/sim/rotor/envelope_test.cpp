// Every condition has an answer: finite, with a status, the same on every run, from a warm or a cold start.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "host/base/random.hpp"
#include "test/unit/sim/rotor/fixtures.hpp"

namespace rotorloop::sim {
namespace {
using test::at;
using test::hover_omega;
using test::rotor;
using test::solve_cold;

bool finite(const RotorLoads& l) {
  return l.force_R_N.allFinite() && l.moment_R_N_m.allFinite() && std::isfinite(l.shaft_torque_N_m) && std::isfinite(l.induced_m_s);
}

TEST(Envelope, TwentyThousandStatesTo30MetresPerSecondAnd2500RadPerSecondAllConvergeAndStayBounded) {
  RotorWarmStart warm;
  int most = 0;
  for (std::uint64_t i = 0; i < 20000; ++i) {
    RotorCondition c = test::random_condition(i, 30.0, 0.0, 2500.0, 20.0);
    const RotorLoads l = solve_rotor(rotor(), c, warm);  // every state a jump from the one before
    ASSERT_TRUE(finite(l)) << i;
    ASSERT_NE(l.status, InflowStatus::not_converged) << i;
    // No load can exceed the dynamic pressure at the advancing tip times blade area times 3.
    const double speed = c.omega_rad_s * rotor().radius_m() + c.v_R_m_s.norm() + 2.0;
    ASSERT_LT(l.force_R_N.norm(), 3.0 * 0.5 * test::kDensity * speed * speed * 3 * 0.0127 * 0.057) << i;
    most = std::max(most, l.iterations);
  }
  EXPECT_LE(most, 60);  // bisection alone would need about 50
  RecordProperty("most_iterations", most);
}
TEST(Envelope, ExactlyAlignedSpeedsAreFinite) {
  for (double vz : {-30.0, -7.46, 0.0, 7.46, 30.0})
    for (double vx : {-30.0, 0.0, 30.0})
      for (double omega : {0.0, 1e-9, 1e-3, 1.0, 15.0, 945.0, 2500.0}) {
        const RotorLoads l = solve_cold(rotor(), at(vx, 0, vz, omega));
        EXPECT_TRUE(finite(l) && l.status != InflowStatus::not_converged) << vx << ' ' << vz << ' ' << omega;
      }
}

TEST(Status, NormalFlightIsConverged) {
  for (double vz : {0.0, 3.1, 10.0}) EXPECT_EQ(solve_cold(rotor(), at(3, 0, vz, hover_omega())).status, InflowStatus::converged);
}
TEST(Status, DescentAtFiveMetresPerSecondIsInTheVortexRing) {
  EXPECT_EQ(solve_cold(rotor(), at(0, 0, -5, hover_omega())).status, InflowStatus::vortex_ring);
  EXPECT_EQ(solve_cold(rotor(), at(0, 0, -0.8, hover_omega())).status, InflowStatus::converged);
  EXPECT_EQ(solve_cold(rotor(), at(12, 0, -5, hover_omega())).status, InflowStatus::converged);  // blown away by edgewise flow
}
TEST(Status, FastDescentIsAWindmill) {
  const RotorLoads l = solve_cold(rotor(), at(0, 0, -28, hover_omega()));
  EXPECT_EQ(l.status, InflowStatus::windmill);
  EXPECT_LT(l.force_R_N.z() * (-28 + l.induced_m_s), 0.0);
}
TEST(Status, FastClimbTurnsASlowRotorLikeAWindmill) {
  const RotorLoads l = solve_cold(rotor(), at(0, 0, 20, 300));
  EXPECT_EQ(l.status, InflowStatus::windmill);
  EXPECT_LT(l.shaft_torque_N_m, 0.0);
}
TEST(Status, TipSpeedBelowOneMetrePerSecondIsStopped) {
  EXPECT_EQ(solve_cold(rotor(), at(0, 0, 0, 0.9 / rotor().radius_m())).status, InflowStatus::stopped);
  EXPECT_EQ(solve_cold(rotor(), at(0, 0, 0, 1.1 / rotor().radius_m())).status, InflowStatus::converged);
}
TEST(Status, ConditionThatIsNotFiniteGivesNoLoadsAndSpoilsNoLaterSolve) {
  RotorWarmStart warm;
  const RotorCondition good = at(5, 1, 0, hover_omega());
  solve_rotor(rotor(), good, warm);
  for (double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    RotorCondition c = good;
    c.v_R_m_s.x() = bad;
    const RotorLoads l = solve_rotor(rotor(), c, warm);
    EXPECT_EQ(l.status, InflowStatus::not_converged);
    EXPECT_EQ(l.force_R_N.norm(), 0.0);
  }
  EXPECT_EQ(solve_rotor(rotor(), good, warm).force_R_N.z(), solve_cold(rotor(), good).force_R_N.z());
}
TEST(Status, TooFewIterationsAreReportedAndGiveAUsableIterate) {
  const Rotor hasty(test::triblade(), {12, 16, 3});
  const RotorLoads l = solve_cold(hasty, at(8, 0, 0, hover_omega())), best = solve_cold(rotor(), at(8, 0, 0, hover_omega()));
  EXPECT_EQ(l.status, InflowStatus::not_converged);
  EXPECT_NEAR(l.force_R_N.z(), best.force_R_N.z(), 0.2 * best.force_R_N.z());
  EXPECT_NE(l.force_R_N.z(), best.force_R_N.z());
}

// Largest difference of the loads, relative to the thrust, or to 5 % of the hover thrust where that is more; moments over the radius.
double difference(const RotorLoads& a, const RotorLoads& b) {
  const double force = std::max(std::abs(b.force_R_N.z()), 0.05 * test::kHoverThrust_N), moment = force * rotor().radius_m();
  return std::max((a.force_R_N - b.force_R_N).norm() / force, (a.moment_R_N_m - b.moment_R_N_m).norm() / moment);
}
TEST(WarmStart, ChangesNoLoadOfAFlightByMoreThan1e12) {
  RotorWarmStart warm;
  double worst = 0.0, iterations = 0.0;
  constexpr int kSteps = 8000;
  for (int step = 0; step < kSteps; ++step) {
    const RotorCondition c = test::flight_state(step);
    const RotorLoads w = solve_rotor(rotor(), c, warm);
    worst = std::max(worst, difference(w, solve_cold(rotor(), c)));
    iterations += w.iterations;
  }
  EXPECT_LE(worst, 1e-12);
  EXPECT_LE(iterations / kSteps, 3.0);  // evaluations of the slowest annulus; a cold start needs about 8
}

// From one state to another that has nothing to do with it. In fast descents some annuli have two solutions (decision 0021), and the
// start decides between them: then the loads differ by 1e-3, and nothing lies between that and 1e-12.
struct WarmCase {
  const char* name;
  double edge_m_s, climb_from_m_s, climb_to_m_s, omega_from_rad_s, omega_to_rad_s;
  int second_solutions;  // at most, of 4000
};
class WarmStartIn : public testing::TestWithParam<WarmCase> {};
TEST_P(WarmStartIn, FarawayStateEndsWithin1e12OfAColdStartOrOnAnotherSolution) {
  const WarmCase& w = GetParam();
  RotorWarmStart warm;
  int others = 0, windmills = 0, rings = 0;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    RotorCondition c = test::random_condition(i, w.edge_m_s, w.omega_from_rad_s, w.omega_to_rad_s, 6.5);
    const double share = 0.5 * (c.v_R_m_s.z() / w.edge_m_s + 1.0);
    c.v_R_m_s.z() = w.climb_from_m_s + (w.climb_to_m_s - w.climb_from_m_s) * share;
    const RotorLoads cold = solve_cold(rotor(), c), l = solve_rotor(rotor(), c, warm);
    ASSERT_NE(l.status, InflowStatus::not_converged);
    windmills += l.status == InflowStatus::windmill;
    rings += l.status == InflowStatus::vortex_ring;
    const double d = difference(l, cold);
    if (d > 1e-6) {
      ++others;
    } else {
      ASSERT_LE(d, 1e-12) << i;
    }
  }
  EXPECT_LE(others, w.second_solutions);
  RecordProperty("second_solutions", others);
  RecordProperty("windmills", windmills);
  RecordProperty("vortex_rings", rings);
}
INSTANTIATE_TEST_SUITE_P(States, WarmStartIn,
                         testing::Values(WarmCase{"flight", 12.0, -3.5, 3.5, 600.0, 1600.0, 0},
                                         WarmCase{"vortex_ring", 5.0, -9.0, -2.0, 700.0, 1300.0, 20},
                                         WarmCase{"windmill_climb", 6.0, 12.0, 22.0, 200.0, 500.0, 0},
                                         WarmCase{"windmill_descent", 6.0, -30.0, -15.0, 600.0, 1200.0, 1000}),
                         [](const auto& p) { return std::string(p.param.name); });
TEST(Determinism, TheSameFlightGivesTheSameBits) {
  const Rotor again(test::triblade());
  RotorWarmStart a, b;
  for (int step = 0; step < 2000; ++step) {
    const RotorLoads x = solve_rotor(rotor(), test::flight_state(step), a), y = solve_rotor(again, test::flight_state(step), b);
    ASSERT_EQ(x.force_R_N, y.force_R_N);
    ASSERT_EQ(x.moment_R_N_m, y.moment_R_N_m);
  }
}

// Steps of 0.02 m/s; thrust changes by at most 0.13 N per m/s in climb, so 0.006 N per step is no step at all.
TEST(Continuity, ThrustAndTorqueRunSmoothlyThroughTheVortexRing) {
  for (double vx : {0.0, 1.0, 4.0, 8.0}) {
    RotorLoads before = solve_cold(rotor(), at(vx, 0, 2, hover_omega()));
    for (double vz = 2; vz > -9; vz -= 0.02) {
      const RotorLoads l = solve_cold(rotor(), at(vx, 0, vz, hover_omega()));
      EXPECT_LT(std::abs(l.force_R_N.z() - before.force_R_N.z()), 0.006) << "vx " << vx << " vz " << vz;
      EXPECT_LT(std::abs(l.shaft_torque_N_m - before.shaft_torque_N_m), 1e-4) << "vx " << vx << " vz " << vz;
      before = l;
    }
  }
}
TEST(Continuity, ThrustRunsSmoothlyAsEdgewiseFlowBlowsTheVortexRingAway) {
  RotorLoads before = solve_cold(rotor(), at(0, 0, -5, hover_omega()));
  for (double vx = 0; vx < 15; vx += 0.02) {
    const RotorLoads l = solve_cold(rotor(), at(vx, 0, -5, hover_omega()));
    EXPECT_LT(std::abs(l.force_R_N.z() - before.force_R_N.z()), 0.006) << vx;
    before = l;
  }
}
TEST(Continuity, LoadsRunSmoothlyFromStandstill) {
  double before = 0.0;
  for (double omega = 0; omega < 100; omega += 0.1) {
    const double thrust = solve_cold(rotor(), at(10, 0, 2, omega)).force_R_N.z();
    if (omega > 0) {
      EXPECT_LT(std::abs(thrust - before), 5e-4) << omega;
    }
    before = thrust;
  }
}

}  // namespace
}  // namespace rotorloop::sim
