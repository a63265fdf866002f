// The nominal thrust and drag: both equations hold at the returned inflow in every flight state, the paper's magnitudes are
// met, and states where momentum theory fails say so.
#include "host/vehicle/thrust.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host/base/random.hpp"
#include "host/vehicle/drag.hpp"

namespace rotorloop::host {
namespace {

// Table I times (60/2π)² and 60/2π.
const ThrustModel kPaper{.k1_N_s2 = 3.119e-6, .k2_N_s2_m = -1.547e-4, .radius_m = 0.0635, .air_density_kg_m3 = 1.2};
constexpr double kHover_rad_s = 938.8;

double change_percent(double v_z, double v_xy) {
  return 100.0 * (solve_thrust(kPaper, kHover_rad_s, v_z, v_xy).thrust_N / solve_thrust(kPaper, kHover_rad_s, 0.0, 0.0).thrust_N - 1.0);
}

TEST(Thrust, BladeAndMomentumThrustAgreeIn20000FlightStates) {
  const RandomStream random(1, 1);
  int worst = 0, worst_in_flight = 0;
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const double omega = 100.0 + 2000.0 * random.uniform(3 * i), v_z = 40.0 * random.uniform(3 * i + 1) - 20.0;
    const double v_xy = i % 7 == 0 ? 0.0 : 20.0 * random.uniform(3 * i + 2);
    const RotorThrust r = solve_thrust(kPaper, omega, v_z, v_xy);
    const double blade_N = 3.119e-6 * omega * omega - 1.547e-4 * omega * (v_z + r.induced_m_s);
    const double momentum_N = 2.0 * 1.2 * M_PI * 0.0635 * 0.0635 * r.induced_m_s * std::hypot(v_z + r.induced_m_s, v_xy);
    ASSERT_NE(r.status, ThrustStatus::not_converged) << omega << ' ' << v_z << ' ' << v_xy;
    ASSERT_NEAR(r.thrust_N, blade_N, 1e-10 * (1.0 + std::fabs(blade_N)));
    ASSERT_NEAR(r.thrust_N, momentum_N, 1e-9 * (1.0 + std::fabs(blade_N))) << omega << ' ' << v_z << ' ' << v_xy;
    worst = std::max(worst, r.iterations);
    if (omega > 400.0 && std::fabs(v_z) < 5.0) worst_in_flight = std::max(worst_in_flight, r.iterations);
  }
  EXPECT_LE(worst_in_flight, 8);
  EXPECT_LE(worst, 20);
}

TEST(Thrust, StillAirCtIs1p897e6AndIndependentOfSpeed) {
  EXPECT_NEAR(static_c_t(kPaper), 1.897e-6, 0.002e-6);
  for (const double omega : {200.0, 940.0, 1780.0}) EXPECT_NEAR(solve_thrust(kPaper, omega, 0.0, 0.0).c_t_N_s2, static_c_t(kPaper), 1e-15);
}

TEST(Thrust, ClimbAt3p1TakesElevenPercentDescentGivesNine) {
  EXPECT_NEAR(change_percent(3.1, 0.0), -11.0, 0.7);
  EXPECT_NEAR(change_percent(-3.1, 0.0), 9.0, 1.0);
}

TEST(Thrust, LevelFlightAddsThrustAsTranslationalLift) {
  EXPECT_NEAR(change_percent(0.0, 4.0), 3.3, 0.5);
  EXPECT_NEAR(change_percent(0.0, 8.5), 12.5, 0.7);
  EXPECT_NEAR(change_percent(0.0, 12.0), 20.0, 1.0);
}

TEST(Thrust, CtDependsOnVelocityOverSpeedAlone) {
  const double one = solve_thrust(kPaper, 700.0, 2.1, 5.6).c_t_N_s2, two = solve_thrust(kPaper, 1400.0, 4.2, 11.2).c_t_N_s2;
  EXPECT_NEAR(one / two, 1.0, 1e-11);
}

TEST(Thrust, FallsSteadilyWithClimbRate) {
  double last = 1e9;
  for (double v_z = -3.0; v_z < 25.0; v_z += 0.25) {
    const double now = solve_thrust(kPaper, kHover_rad_s, v_z, 3.0).thrust_N;
    ASSERT_LT(now, last) << v_z;
    last = now;
  }
}

TEST(Thrust, SaysWhereMomentumTheoryEnds) {
  EXPECT_EQ(solve_thrust(kPaper, kHover_rad_s, 0.0, 0.0).status, ThrustStatus::normal);
  EXPECT_EQ(solve_thrust(kPaper, kHover_rad_s, -3.1, 0.0).status, ThrustStatus::normal);  // the paper's descent
  EXPECT_EQ(solve_thrust(kPaper, kHover_rad_s, -4.5, 0.0).status, ThrustStatus::deep_descent);
  EXPECT_EQ(solve_thrust(kPaper, kHover_rad_s, -4.5, 9.0).status, ThrustStatus::normal);  // blown clear sideways
  EXPECT_EQ(solve_thrust(kPaper, kHover_rad_s, 25.0, 0.0).status, ThrustStatus::negative_thrust);
  EXPECT_LT(solve_thrust(kPaper, kHover_rad_s, 25.0, 0.0).thrust_N, 0.0);
  EXPECT_EQ(solve_thrust(kPaper, 0.0, 3.0, 1.0).status, ThrustStatus::stopped);
}

TEST(Thrust, BadNumbersGiveZeroThrustAndSaySo) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinity, -infinity}) {
    for (const RotorThrust& r : {solve_thrust(kPaper, bad, 0, 0), solve_thrust(kPaper, 900, bad, 0), solve_thrust(kPaper, 900, 0, bad)}) {
      EXPECT_EQ(r.status, ThrustStatus::bad_input);
      EXPECT_EQ(r.thrust_N, 0.0);
    }
  }
  EXPECT_EQ(solve_thrust(ThrustModel{}, 900, 0, 0).status, ThrustStatus::bad_input);
}

TEST(Thrust, FigureOfMeritIs0p48InSiAnd0p05WhenRpmIsReadAsRadPerSecond) {
  EXPECT_NEAR(figure_of_merit(kPaper, 3.10e-8), 0.48, 0.005);
  ThrustModel slipped = kPaper;
  slipped.k1_N_s2 = 3.42e-8;
  slipped.k2_N_s2_m = -1.62e-5;
  EXPECT_NEAR(figure_of_merit(slipped, 3.40e-10), 0.05, 0.005);
}

TEST(Drag, At8p5LevelIs1p0FromRotorsAnd0p40FromTheFrame) {
  const DragModel paper{.c_dh_s_m = 0.0175, .c_dxy_N_s2_m2 = 0.0055, .c_dz_N_s2_m2 = 0.0185};
  EXPECT_NEAR(rotor_drag_B_N(paper, 0.682 * kGravity_m_s2, {8.5, 0, 0}).x(), -1.0, 0.02);
  EXPECT_NEAR(airframe_drag_B_N(paper, {8.5, 0, 0}).x(), -0.40, 0.01);
  EXPECT_NEAR(airframe_drag_B_N(paper, {0, 0, -3.1}).z(), 0.18, 0.01);
  EXPECT_EQ(rotor_drag_B_N(paper, 6.7, {0, 0, 5}).norm(), 0.0);
}

TEST(Drag, NeverDoesPositiveWork) {
  const DragModel paper{.c_dh_s_m = 0.0175, .c_dxy_N_s2_m2 = 0.0055, .c_dz_N_s2_m2 = 0.0185};
  const RandomStream random(2, 1);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const Eigen::Vector3d v(20 * random.uniform(3 * i) - 10, 20 * random.uniform(3 * i + 1) - 10, 20 * random.uniform(3 * i + 2) - 10);
    ASSERT_LE((rotor_drag_B_N(paper, 7.0, v) + airframe_drag_B_N(paper, v)).dot(v), 0.0);
  }
}

}  // namespace
}  // namespace rotorloop::host
