// The mixer, judged by what its speeds do to a vehicle written independently (test_flight.hpp): thrust and torque of eq. (3).
#include "host/control/mixer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "host/base/random.hpp"
#include "test/unit/host/control/paper_vehicle.hpp"
#include "test/unit/host/control/test_flight.hpp"

namespace rotorloop::host {
namespace {

using V3 = Eigen::Vector3d;
using Speeds = std::array<double, kRotors>;

struct Wrench {
  double thrust_N = 0.0;
  V3 torque_N_m = V3::Zero();
};

// What these speeds produce, by the test vehicle's own equations.
Wrench produced(const Speeds& omega, const V3& v_B, const V3& w_B, const V3& com = {0.0014, 0.000177, 0.0}) {
  const test::QuadTruth truth;
  constexpr double l = 0.0885;
  const double x[4] = {l, -l, l, -l}, y[4] = {-l, l, l, -l}, sign[4] = {-1, -1, 1, 1};
  Wrench out;
  for (int i = 0; i < 4; ++i) {
    const V3 v = v_B + w_B.cross(V3(x[i], y[i], 0) - com);
    const double speed = omega[static_cast<std::size_t>(i)];
    const double t = test::rotor_thrust(truth, speed, v.z(), std::hypot(v.x(), v.y()));
    out.thrust_N += t;
    out.torque_N_m += V3((y[i] - com.y()) * t, -(x[i] - com.x()) * t, sign[i] * truth.c_q * speed * speed);
  }
  return out;
}

Speeds hover_guess() {
  Speeds s;
  s.fill(939.0);
  return s;
}

const Mixer& full() {
  static const Mixer m(test::paper_vehicle(), {});
  return m;
}

MixerDemand demand(double thrust, V3 torque, V3 v = V3::Zero(), V3 w = V3::Zero()) { return {thrust, torque, v, w}; }

TEST(Mixer, DeliversThrustAndTorqueThroughoutTheEnvelope) {
  const RandomStream r(5, 1);
  int most = 0;
  for (std::uint64_t k = 0; k < 2000; ++k) {
    const auto u = [&](std::uint64_t j) { return 2.0 * r.uniform(20 * k + j) - 1.0; };
    const MixerDemand d = demand(8.0 + 3.0 * u(0), V3(0.06 * u(1), 0.06 * u(2), 0.02 * u(3)), V3(8 * u(4), 8 * u(5), 3 * u(6)),
                                 V3(4 * u(7), 4 * u(8), 4 * u(9)));
    const MixerResult m = full().solve(d, hover_guess());
    const Wrench w = produced(m.omega_rad_s, d.v_B_m_s, d.w_B_rad_s);
    ASSERT_FALSE(m.yaw_limited || m.thrust_limited || m.torque_limited);
    ASSERT_LE(m.residual_rad_s, Mixer::kConverged_rad_s);
    ASSERT_NEAR(w.thrust_N, d.thrust_N, 2e-3 * d.thrust_N);
    ASSERT_NEAR(w.torque_N_m.x(), d.torque_B_N_m.x(), 1e-3);
    ASSERT_NEAR(w.torque_N_m.y(), d.torque_B_N_m.y(), 1e-3);
    ASSERT_NEAR(w.torque_N_m.z(), d.torque_B_N_m.z(), 2e-4);
    most = std::max(most, m.iterations);
  }
  EXPECT_LE(most, 4);
}

// Torque of c_q(J) written out anew: J = v / (n D), n in turns per second.
double yaw_with_advance(const VehicleModel& v, const Speeds& omega, const V3& v_B, const V3& w_B, const AdvanceModel& a) {
  constexpr double sign[4] = {-1, -1, 1, 1};
  double yaw = 0.0;
  for (int i = 0; i < 4; ++i) {
    const double speed = omega[static_cast<std::size_t>(i)], n = speed / 6.283185307179586, v_z = (v_B + w_B.cross(v.arm_m(i))).z();
    const double J = std::min(std::max(v_z / (n * 2.0 * v.thrust.radius_m), a.j_low), a.j_high);
    yaw += sign[i] * (v.c_q_N_m_s2 + a.c_q2_N_m_s2 * J * J) * speed * speed;
  }
  return yaw;
}

// Rotors in like flow add the same and cancel between the pairs: only a body that turns about two axes at once shows c_q(J).
TEST(Mixer, YawTorqueHoldsInAFastTurnAboutTwoAxesWithTorqueThatFallsWithTheAdvanceRatio) {
  const AdvanceModel falls{-1.5e-8, -1.0, 1.0};
  VehicleModel v = test::paper_vehicle();
  const auto missed_N_m = [&](const AdvanceModel& nominal, const V3& w) {
    VehicleModel flown = v;
    flown.advance = nominal;
    const Mixer mixer(flown, {});
    const MixerDemand d = demand(8.0, V3(0, 0, 0.01), V3(0, 0, 3.0), w);
    const MixerResult m = mixer.solve(d, hover_guess());
    EXPECT_LT(m.residual_rad_s, Mixer::kConverged_rad_s);
    return std::fabs(yaw_with_advance(v, m.omega_rad_s, d.v_B_m_s, w, falls) - 0.01);
  };
  EXPECT_LT(missed_N_m(falls, V3(20, 20, 0)), 5e-5);
  EXPECT_GT(missed_N_m({}, V3(20, 20, 0)), 5e-4);
  EXPECT_LT(missed_N_m({}, V3::Zero()), 5e-5);  // a climb at 3 m/s alone: nothing to gain
}

TEST(Mixer, StaticCtMissesThrustByElevenPercentInAClimbAt3p1) {
  const V3 climb(0, 0, 3.1);
  const Mixer still(test::paper_vehicle(), {.lookup = ThrustLookup::still_air});
  const double wanted = 6.69;
  EXPECT_NEAR(produced(still.solve(demand(wanted, V3::Zero(), climb), hover_guess()).omega_rad_s, climb, V3::Zero()).thrust_N / wanted,
              0.89, 0.01);
  EXPECT_NEAR(produced(full().solve(demand(wanted, V3::Zero(), climb), hover_guess()).omega_rad_s, climb, V3::Zero()).thrust_N / wanted,
              1.0, 0.002);
}

TEST(Mixer, IgnoringTheCentreOfMassTiltsTheHoverByNineMillinewtonmetres) {
  VehicleModel centred = test::paper_vehicle();
  centred.com_offset_m.setZero();
  const Mixer naive(centred, {});
  const MixerDemand d = demand(6.69, V3::Zero());
  EXPECT_NEAR(produced(naive.solve(d, hover_guess()).omega_rad_s, V3::Zero(), V3::Zero()).torque_N_m.y(), 6.69 * 0.0014, 5e-4);
  EXPECT_NEAR(produced(full().solve(d, hover_guess()).omega_rad_s, V3::Zero(), V3::Zero()).torque_N_m.y(), 0.0, 1e-5);
}

TEST(Mixer, RatesAtTheArmsMatterInAFastRoll) {
  const V3 roll(6.0, 0, 0);
  const Mixer central(test::paper_vehicle(), {.local_velocity = false});
  const MixerDemand d = demand(8.0, V3::Zero(), V3::Zero(), roll);
  const double naive = std::fabs(produced(central.solve(d, hover_guess()).omega_rad_s, V3::Zero(), roll).torque_N_m.x());
  const double local = std::fabs(produced(full().solve(d, hover_guess()).omega_rad_s, V3::Zero(), roll).torque_N_m.x());
  EXPECT_GT(naive, 0.01);  // rate damping of the rotors
  EXPECT_LT(local, 1e-3);
}

TEST(Mixer, SignsFollowTheConventions) {
  const auto change = [](const V3& torque) {
    const Speeds a = full().solve(demand(6.69, V3::Zero()), hover_guess()).omega_rad_s,
                 b = full().solve(demand(6.69, torque), hover_guess()).omega_rad_s;
    Speeds d;
    for (std::size_t i = 0; i < 4; ++i) d[i] = b[i] - a[i];
    return d;
  };
  const Speeds roll = change({0.02, 0, 0});  // +x: left side up, so rotors 2 and 3 faster
  EXPECT_TRUE(roll[1] > 0 && roll[2] > 0 && roll[0] < 0 && roll[3] < 0);
  const Speeds pitch = change({0, 0.02, 0});  // +y: nose down, so rear rotors 2 and 4 faster
  EXPECT_TRUE(pitch[1] > 0 && pitch[3] > 0 && pitch[0] < 0 && pitch[2] < 0);
  const Speeds yaw = change({0, 0, 0.005});  // +z: rotors 3 and 4 faster
  EXPECT_TRUE(yaw[2] > 0 && yaw[3] > 0 && yaw[0] < 0 && yaw[1] < 0);
}

TEST(Mixer, YawGivesWayFirstAndThrustAndTiltTorqueStayWhole) {
  const MixerDemand d = demand(6.69, V3(0.1, -0.08, 0.5));
  const MixerResult m = full().solve(d, hover_guess());
  const Wrench w = produced(m.omega_rad_s, V3::Zero(), V3::Zero());
  EXPECT_TRUE(m.yaw_limited);
  EXPECT_FALSE(m.thrust_limited || m.torque_limited);
  EXPECT_NEAR(w.thrust_N, 6.69, 0.02);
  EXPECT_NEAR(w.torque_N_m.x(), 0.1, 2e-3);
  EXPECT_NEAR(w.torque_N_m.y(), -0.08, 2e-3);
  EXPECT_GT(w.torque_N_m.z(), 0.02);
  EXPECT_LT(w.torque_N_m.z(), 0.5);
}

TEST(Mixer, ClippingSpeedsInsteadWouldSpoilThrustAndTilt) {
  // The damage without priorities: the same demand with unbounded speeds, then clipped rotor by rotor.
  const MixerDemand d = demand(6.69, V3(0.1, -0.08, 0.5));
  const double c_t = 1.897e-6, c_q = 3.10e-8, l = 0.0885;
  Speeds clipped;
  const double sx[4] = {-1, 1, 1, -1}, sy[4] = {-1, 1, -1, 1}, sz[4] = {-1, -1, 1, 1};
  for (std::size_t i = 0; i < 4; ++i) {
    const double square = d.thrust_N / (4 * c_t) + sx[i] * 0.1 / (4 * l * c_t) + sy[i] * -0.08 / (4 * l * c_t) + sz[i] * 0.5 / (4 * c_q);
    clipped[i] = std::clamp(std::sqrt(std::fmax(square, 0.0)), 250.0, 1780.2);
  }
  const Wrench w = produced(clipped, V3::Zero(), V3::Zero());
  EXPECT_GT(std::fabs(w.thrust_N - 6.69), 3.0);
  EXPECT_GT(std::fabs(w.torque_N_m.x() - 0.1) + std::fabs(w.torque_N_m.y() + 0.08), 0.05);
}

TEST(Mixer, ThrustGivesWayToTiltTorqueAtTheCeiling) {
  const MixerDemand d = demand(23.5, V3(0.25, 0, 0));
  const MixerResult m = full().solve(d, hover_guess());
  const Wrench w = produced(m.omega_rad_s, V3::Zero(), V3::Zero());
  EXPECT_TRUE(m.thrust_limited);
  EXPECT_FALSE(m.torque_limited);
  EXPECT_NEAR(w.torque_N_m.x(), 0.25, 3e-3);
  EXPECT_LT(w.thrust_N, 23.0);
}

TEST(Mixer, ThrustRisesForTiltTorqueAtTheFloor) {
  const MixerDemand d = demand(0.0, V3(0.15, 0, 0));
  const MixerResult m = full().solve(d, hover_guess());
  const Wrench w = produced(m.omega_rad_s, V3::Zero(), V3::Zero());
  EXPECT_TRUE(m.thrust_limited);
  EXPECT_NEAR(w.torque_N_m.x(), 0.15, 3e-3);
  EXPECT_GT(w.thrust_N, 1.0);
}

TEST(Mixer, ImpossibleTiltTorqueIsShortenedInItsOwnDirection) {
  const MixerDemand d = demand(12.0, V3(3.0, -1.5, 0));
  const MixerResult m = full().solve(d, hover_guess());
  const Wrench w = produced(m.omega_rad_s, V3::Zero(), V3::Zero());
  EXPECT_TRUE(m.torque_limited);
  EXPECT_GT(w.torque_N_m.x(), 0.3);
  EXPECT_NEAR(w.torque_N_m.y() / w.torque_N_m.x(), -0.5, 0.02);
}

TEST(Mixer, SpeedsStayBetweenTheirLimitsForAnyFiniteDemand) {
  const RandomStream r(6, 1);
  for (std::uint64_t k = 0; k < 5000; ++k) {
    const auto u = [&](std::uint64_t j) { return 2.0 * r.uniform(20 * k + j) - 1.0; };
    const double scale = std::pow(10.0, 3.0 * u(10));
    const MixerResult m = full().solve(
        demand(20 * scale * u(0), scale * V3(u(1), u(2), u(3)), 10 * scale * V3(u(4), u(5), u(6)), scale * V3(u(7), u(8), u(9))),
        hover_guess());
    for (const double omega : m.omega_rad_s) {
      ASSERT_GE(omega, 250.0 - 1e-9);
      ASSERT_LE(omega, 1780.2 + 1e-9);
    }
  }
}

}  // namespace
}  // namespace rotorloop::host
