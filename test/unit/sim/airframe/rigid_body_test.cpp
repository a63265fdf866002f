// The rigid body against closed-form motion and conserved quantities, and the order of its integrator.
#include <gtest/gtest.h>

#include <limits>

#include "host/base/error.hpp"
#include "sim/effects/effect_set.hpp"
#include "test/unit/sim/airframe/fixture.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

constexpr Four kRotorsStopped{0, 0, 0, 0};
const FourLoads kNoLoads{};

void run(Airframe& a, double seconds) {
  const auto steps = static_cast<int>(std::lround(seconds * 1e9 / static_cast<double>(a.config().step_ns)));
  for (int i = 0; i < steps; ++i) a.step(kNoLoads, kRotorsStopped, kRotorsStopped);
}
AirframeConfig in_vacuum() {
  AirframeConfig c = reference_body();
  c.drag_xy_N_s2_m2 = c.drag_z_N_s2_m2 = 0.0;
  return c;
}

TEST(RigidBody, FallsAsAParabola) {
  AirframeState s = at_height(100.0);
  s.v_W_m_s = {3.0, -2.0, 1.0};
  Airframe a(in_vacuum(), s);
  run(a, 2.0);
  EXPECT_LT((a.state().p_W_m - Eigen::Vector3d(6.0, -4.0, 102.0 - 2.0 * kGravity_m_s2)).norm(), 1e-9);
  EXPECT_EQ(a.state().time_ns, 2'000'000'000);
  EXPECT_LT(a.state().specific_force_B_m_s2.norm(), 1e-12) << "an accelerometer in free fall reads zero";
}

TEST(RigidBody, TerminalSpeedOfAFallIsWhereDragEqualsWeight) {
  Airframe a(reference_body(), at_height(1000.0));
  run(a, 15.0);
  EXPECT_NEAR(a.state().v_W_m_s.z(), -std::sqrt(kMass_kg * kGravity_m_s2 / 0.0185), 1e-3);
}

TEST(RigidBody, BodyDragOpposesTheMotionInEveryDirectionOfThePlane) {
  for (double angle = 0.0; angle < 6.28; angle += 0.3) {
    AirframeState s;
    s.v_W_m_s = 8.5 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    Airframe a(reference_body(), s);
    run(a, 5e-4);
    EXPECT_LT((a.wrench().drag_force_B_N + 0.0055 * 8.5 * s.v_W_m_s).norm(), 1e-12);  // 0.40 N at 8.5 m/s
  }
}

TEST(RigidBody, DragVanishesInAWindOfTheSameSpeed) {
  AirframeConfig c = reference_body();
  c.wind_W_m_s = {4.0, 1.0, 0.0};
  AirframeState s;
  s.v_W_m_s = {4.0, 1.0, 0.0};
  Airframe a(c, s);
  run(a, 5e-4);
  EXPECT_LT(a.wrench().drag_force_B_N.norm(), 1e-15);
}

TEST(RigidBody, SymmetricTopPrecessesAtTheRateAndInTheSenseOfEuler) {
  AirframeConfig c = in_vacuum();
  const double transverse = 3e-3, axial = 5e-3, spin_rad_s = 8.0;
  c.inertia_kg_m2 = Eigen::Vector3d(transverse, transverse, axial).asDiagonal();
  AirframeState s;
  s.w_B_rad_s = {1.0, 0.0, spin_rad_s};
  Airframe a(c, s);
  run(a, 0.5);
  // w_x + i w_y turns at (I3 - I1)/I1 * w_z; the other sign of Omega x I Omega would turn it backwards.
  const double angle = (axial - transverse) / transverse * spin_rad_s * 0.5;
  EXPECT_NEAR(a.state().w_B_rad_s.x(), std::cos(angle), 1e-9);
  EXPECT_NEAR(a.state().w_B_rad_s.y(), std::sin(angle), 1e-9);
}

TEST(RigidBody, FreeTumblingKeepsAngularMomentumAndEnergyWithAFullInertiaMatrix) {
  AirframeConfig c = in_vacuum();
  c.inertia_kg_m2 << 2.41e-3, 2e-4, -1e-4, 2e-4, 3.42e-3, 3e-4, -1e-4, 3e-4, 5.22e-3;
  AirframeState s;
  s.w_B_rad_s = {0.3, 9.0, 0.2};  // about the middle axis: unstable, the body flips
  Airframe a(c, s);
  const auto momentum = [&] { return Eigen::Vector3d(a.state().q_WB * (c.inertia_kg_m2 * a.state().w_B_rad_s)); };
  const auto energy = [&] { return a.state().w_B_rad_s.dot(c.inertia_kg_m2 * a.state().w_B_rad_s); };
  const Eigen::Vector3d L0 = momentum();
  const double E0 = energy();
  double lowest_w_y = 9.0;
  for (int i = 0; i < 8000; ++i) {
    a.step(kNoLoads, kRotorsStopped, kRotorsStopped);
    lowest_w_y = std::min(lowest_w_y, a.state().w_B_rad_s.y());
  }
  EXPECT_LT(lowest_w_y, -5.0) << "the flip is what makes this a test of the coupling terms";
  EXPECT_LT((momentum() - L0).norm() / L0.norm(), 1e-8);
  EXPECT_NEAR(energy() / E0, 1.0, 1e-8);
  EXPECT_NEAR(a.state().q_WB.norm(), 1.0, 1e-15);
}

TEST(RigidBody, MotionDoesNotDependOnTheChoiceOfBodyAxes) {
  // The same body described in axes turned by Q: inertia and moment turn along, the motion in the world is the same.
  const Eigen::Quaterniond Q = Eigen::Quaterniond(0.9, 0.2, -0.3, 0.1).normalized();
  const Eigen::Matrix3d R = Q.toRotationMatrix();
  AirframeConfig plain = in_vacuum(), turned = in_vacuum();
  turned.inertia_kg_m2 = R * plain.inertia_kg_m2 * R.transpose();
  turned.inertia_kg_m2 = (0.5 * (turned.inertia_kg_m2 + turned.inertia_kg_m2.transpose())).eval();
  AirframeState s, t;
  s.w_B_rad_s = {3.0, -1.0, 2.0};
  t.w_B_rad_s = R * s.w_B_rad_s;
  t.q_WB = Q.conjugate();
  Airframe a(plain, s), b(turned, t);
  FourLoads on_a{}, on_b{};
  on_a[0].moment_R_N_m = {0.01, -0.02, 0.005};
  on_b[0].moment_R_N_m = R * on_a[0].moment_R_N_m;
  for (int i = 0; i < 1000; ++i) {
    a.step(on_a, kRotorsStopped, kRotorsStopped);
    b.step(on_b, kRotorsStopped, kRotorsStopped);
  }
  EXPECT_LT((a.state().q_WB * a.state().w_B_rad_s - b.state().q_WB * b.state().w_B_rad_s).norm(), 1e-9);
}

// Rotors spun up by their own motors on a free body: only internal torques, so body and rotors together keep their momentum.
double momentum_gained(bool gyroscopic, bool reaction) {
  AirframeConfig c = in_vacuum();
  c.gravity_m_s2 = 0.0;
  EffectSet effects;
  if (gyroscopic) effects.add("gyroscopic", 0.0);
  if (reaction) effects.add("rotor_inertia_reaction", 0.0);
  c.rotors[1].tilt_rad = {0.1, -0.2};
  AirframeState s;
  s.w_B_rad_s = {2.0, 1.0, -1.0};
  Airframe a(c, s);
  const Four omega_dot{4000.0, 1000.0, 2500.0, 0.0};
  Four omega{100.0, 200.0, 300.0, 400.0};
  const Eigen::Vector3d tilted_axis =
      Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()) * (Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()) * Eigen::Vector3d::UnitZ());
  const auto momentum = [&] {
    Eigen::Vector3d L_B = c.inertia_kg_m2 * a.state().w_B_rad_s;
    for (std::size_t i = 0; i < 4; ++i) L_B += (c.rotors[i].spin * 9.4e-6 * omega[i]) * (i == 1 ? tilted_axis : Eigen::Vector3d::UnitZ());
    return Eigen::Vector3d(a.state().q_WB * L_B);
  };
  const Eigen::Vector3d before = momentum();
  for (int i = 0; i < 600; ++i) {
    a.step(kNoLoads, omega, omega_dot, a.air(), &effects);
    for (std::size_t k = 0; k < 4; ++k) omega[k] += 5e-4 * omega_dot[k];
  }
  return (momentum() - before).norm() / before.norm();
}
TEST(RigidBody, BodyAndRotorsTogetherKeepTheirAngularMomentum) {
  EXPECT_LT(momentum_gained(true, true), 1e-9);
  EXPECT_GT(momentum_gained(false, true), 0.05) << "without the gyroscopic moment momentum appears from nowhere";
  EXPECT_GT(momentum_gained(true, false), 0.05) << "without the reaction too";
}

// A second of flight with rotor loads that answer to motion; speeds swing, so that loads change within a step.
AirframeState flight(std::int64_t step_ns) {
  AirframeConfig c = reference_body();
  c.step_ns = step_ns;
  EffectSet effects;
  effects.add("gyroscopic", 0.0);
  effects.add("rotor_inertia_reaction", 0.0);
  Airframe a(c, at_height(10.0));
  const double h = static_cast<double>(step_ns) * 1e-9;
  const auto speed = [](std::size_t i, double t) {
    return 945.0 + 40.0 * std::sin(25.0 * t + static_cast<double>(i * i)) - 40.0 * std::sin(static_cast<double>(i * i));
  };
  const auto steps = 1'000'000'000 / step_ns;
  for (std::int64_t n = 0; n < steps; ++n) {
    const double t = static_cast<double>(n) * h;
    FourLoads loads;
    Four omega, omega_dot;
    for (std::size_t i = 0; i < 4; ++i) {
      omega[i] = speed(i, t);
      omega_dot[i] = (speed(i, t + h) - omega[i]) / h;
      loads[i] = analytic_rotor(a.rotor_condition(i, omega[i]));
    }
    a.step(loads, omega, omega_dot, a.air(), &effects);
  }
  return a.state();
}
TEST(RigidBody, HalvingTheStepChangesAFlightByLessThanOnePercentAndTheErrorFallsFourfold) {
  const AirframeState coarse = flight(500'000), fine = flight(250'000), finest = flight(125'000), truth = flight(15'625);
  const auto error = [&](const AirframeState& s) { return (s.p_W_m - truth.p_W_m).norm() + 0.1 * (s.w_B_rad_s - truth.w_B_rad_s).norm(); };
  const double flown = (truth.p_W_m - Eigen::Vector3d(0, 0, 10)).norm();
  EXPECT_GT(flown, 0.5);
  EXPECT_LT((coarse.p_W_m - fine.p_W_m).norm(), 0.001 * flown);
  EXPECT_GT(error(coarse) / error(fine), 3.4) << "second order: held loads alone would give 2";
  EXPECT_GT(error(fine) / error(finest), 3.4);
}

TEST(RigidBody, TheSameRunTwiceIsTheSameBitByBit) {
  const AirframeState a = flight(500'000), b = flight(500'000);
  EXPECT_EQ(a.p_W_m, b.p_W_m);
  EXPECT_EQ(a.w_B_rad_s, b.w_B_rad_s);
  EXPECT_EQ(a.q_WB.coeffs(), b.q_WB.coeffs());
}

TEST(LaunchStand, HoldsTheBodyAndRecordsWhatItHasToHold) {
  AirframeState s = at_height(1.5);
  s.v_W_m_s = {1.0, 0.0, 0.0};  // not on a stand
  Airframe a(reference_body(), s, 10'000'000);
  FourLoads loads{};
  for (auto& l : loads) l.force_R_N.z() = 3.0;
  for (int i = 0; i < 19; ++i) EXPECT_EQ(a.step(loads, kRotorsStopped, kRotorsStopped), AirframeStatus::clamped);
  EXPECT_EQ(a.state().p_W_m, Eigen::Vector3d(0, 0, 1.5));
  EXPECT_EQ(a.state().v_W_m_s, Eigen::Vector3d::Zero().eval());
  EXPECT_EQ(a.wrench().rotor_force_B_N.z(), 12.0);
  EXPECT_NEAR(a.state().specific_force_B_m_s2.z(), kGravity_m_s2, 1e-12);
  EXPECT_EQ(a.step(loads, kRotorsStopped, kRotorsStopped), AirframeStatus::flying) << "released at 10 ms";
  EXPECT_EQ(a.state().v_W_m_s.z(), 0.0);
  a.step(loads, kRotorsStopped, kRotorsStopped);
  EXPECT_NEAR(a.state().v_W_m_s.z(), (12.0 / kMass_kg - kGravity_m_s2) * 5e-4, 1e-6);
}

TEST(LaunchStand, ATiltedBodyAtRestFeelsGravityInItsOwnFrame) {
  AirframeState s = at_height(1.0);
  s.q_WB = Eigen::Quaterniond(std::sqrt(0.5), std::sqrt(0.5), 0, 0);  // left side up
  EXPECT_LT((Airframe(reference_body(), s, 1).state().specific_force_B_m_s2 - Eigen::Vector3d(0, kGravity_m_s2, 0)).norm(), 1e-12);
}

TEST(FlightEnd, BelowGroundIsReportedAndTheStateOfTheImpactStays) {
  AirframeConfig c = in_vacuum();
  c.ground_z_m = 0.0;
  Airframe a(c, at_height(1.0));
  run(a, 1.0);
  EXPECT_EQ(a.status(), AirframeStatus::below_ground);
  EXPECT_TRUE(a.ended());
  EXPECT_NEAR(a.state().p_W_m.z(), 0.0, 3e-3);
  EXPECT_NEAR(a.state().v_W_m_s.z(), -std::sqrt(2.0 * kGravity_m_s2), 0.01);
  EXPECT_EQ(a.state().time_ns, 1'000'000'000) << "the clock runs on";
}

TEST(FlightEnd, LoadsThatAreNotFiniteEndTheFlightAndNeverReachTheState) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e12}) {
    for (int place = 0; place < 4; ++place) {
      AirframeConfig c = reference_body();
      EffectSet effects;
      effects.add("rotor_inertia_reaction", 0.0);
      effects.add("gyroscopic", 0.0);
      AirframeState s = at_height(10.0);
      s.w_B_rad_s = {1.0, 1.0, 1.0};
      Airframe a(c, s);
      FourLoads loads{};
      Four omega{900, 900, 900, 900}, omega_dot{};
      if (place == 0) loads[2].force_R_N.x() = bad;
      if (place == 1) loads[1].moment_R_N_m.y() = bad;
      if (place == 2) omega[3] = bad;
      if (place == 3) omega_dot[0] = bad;
      a.step(loads, omega, omega_dot, a.air(), &effects);
      EXPECT_EQ(a.status(), AirframeStatus::diverged) << bad << " at place " << place;
      a.step(kNoLoads, kRotorsStopped, kRotorsStopped);
      EXPECT_EQ(a.status(), AirframeStatus::diverged) << "it stays ended";
      EXPECT_TRUE(a.state().p_W_m.allFinite() && a.state().w_B_rad_s.allFinite() && a.state().q_WB.coeffs().allFinite());
      EXPECT_EQ(a.state().p_W_m.z(), 10.0);
    }
  }
}

TEST(AirframeConfig, ABodyThatCannotExistIsRefused) {
  const auto refused = [](auto change) {
    AirframeConfig c = reference_body();
    change(c);
    EXPECT_THROW(Airframe(c, AirframeState{}), Error);
  };
  refused([](AirframeConfig& c) { c.mass_kg = 0.0; });
  refused([](AirframeConfig& c) { c.mass_kg = std::numeric_limits<double>::quiet_NaN(); });
  refused([](AirframeConfig& c) { c.inertia_kg_m2(2, 2) = 7e-3; });  // more than the sum of the others
  refused([](AirframeConfig& c) { c.inertia_kg_m2(0, 1) = 1e-3; });  // not symmetric
  refused([](AirframeConfig& c) { c.inertia_kg_m2(1, 1) = -3e-3; });
  refused([](AirframeConfig& c) { c.step_ns = 1'000'000; });  // 1 kHz is too slow
  refused([](AirframeConfig& c) { c.rotors[0].spin = 0; });
}

}  // namespace
}  // namespace rotorloop::sim
