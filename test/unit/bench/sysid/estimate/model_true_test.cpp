// The independent flights that identification is judged by: their physics, their noise and their excitation, by means that do not
// need the generator's own loop.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "test/support/model_true_flight.hpp"

namespace rotorloop::model_true {
namespace {
using Eigen::Quaterniond;
using Eigen::Vector3d;

const Truth kTruth;

FlightSettings quiet(Manoeuvre m, double duration_s) {
  FlightSettings s;
  s.manoeuvre = m;
  s.duration_s = duration_s;
  s.q_a_m_s2_rtHz = s.q_alpha_rad_s2_rtHz = s.pose_sigma_m = s.pose_sigma_rad = 0.0;
  return s;
}

TEST(ModelTrueThrust, SolvesEquationOneAndTwoTo1e12OverTheFlownEnvelope) {
  const double two_rho_A = 2.0 * 1.2 * std::numbers::pi * 0.0635 * 0.0635;
  for (double omega : {260.0, 600.0, 940.0, 1500.0, 1800.0}) {
    for (double vz : {-2.0, -0.5, 0.0, 1.0, 3.5, 6.0}) {
      for (double vxy : {0.0, 0.3, 3.0, 10.5}) {
        const Vector3d v(0.6 * vxy, -0.8 * vxy, vz);
        RotorThrust r;
        try {
          r = rotor_thrust(kTruth, omega, v);
        } catch (const std::domain_error&) {
          EXPECT_TRUE(vz < 0.0 || omega < 400.0) << omega << " rad/s, v_z " << vz;  // slow rotor in a fast stream only
          continue;
        }
        const double w = vz + r.induced_m_s, scale = 3.12e-6 * omega * omega;
        EXPECT_GT(w, 0.0);
        EXPECT_NEAR(r.thrust_N, 3.12e-6 * omega * omega - 1.55e-4 * omega * w, 1e-12 * scale);
        EXPECT_NEAR(r.thrust_N, two_rho_A * r.induced_m_s * std::hypot(w, vxy), 1e-12 * scale);
        if (r.thrust_N > 0.01) {
          EXPECT_NEAR(rotor_speed_for(kTruth, r.thrust_N, v), omega, 1e-7 * omega);
        }
      }
    }
  }
}

TEST(ModelTrueThrust, RefusesADescentWithoutThroughFlow) {
  EXPECT_THROW(rotor_thrust(kTruth, 300.0, Vector3d(5.0, 0.0, -8.0)), std::domain_error);
}

TEST(ModelTrueThrust, HoverSpeedIs939RadPerSecondByTheStaticCoefficient) {
  const double c_t = static_thrust_coefficient(kTruth);
  EXPECT_NEAR(c_t, 1.897e-6, 0.002e-6);  // N s², the paper's k1 and k2 at rest
  const RotorSpeeds w = hover_speeds(kTruth);
  double sum = 0.0;
  for (double omega : w) sum += c_t * omega * omega;
  EXPECT_NEAR(sum, 0.682 * kGravity_m_s2, 1e-9);
  EXPECT_NEAR(std::accumulate(w.begin(), w.end(), 0.0) / 4, 939.0, 1.0);
  const Loads l = loads(kTruth, State{}, w);  // and the offset centre of mass is balanced
  EXPECT_LT(l.torque_B_N_m.norm(), 1e-9);
}

TEST(ModelTrueLoads, TurnTheWayOfEquationThree) {
  Truth t;
  t.com_offset_m.setZero();
  const auto torque = [&](const RotorSpeeds& w) { return loads(t, State{}, w).torque_B_N_m; };
  const double thrust_difference = rotor_thrust(t, 1000, Vector3d::Zero()).thrust_N - rotor_thrust(t, 900, Vector3d::Zero()).thrust_N;
  EXPECT_NEAR(torque({900, 1000, 1000, 900}).x(), 2 * 0.0885 * thrust_difference, 1e-12);              // left rotors 2, 3 up: roll right
  EXPECT_NEAR(torque({900, 1000, 900, 1000}).y(), 2 * 0.0885 * thrust_difference, 1e-12);              // rear rotors 2, 4 up: nose down
  EXPECT_NEAR(torque({900, 900, 1000, 1000}).z(), 2 * 3.1e-8 * (1000.0 * 1000 - 900.0 * 900), 1e-12);  // 3, 4 give +z
  t.com_offset_m << 0.01, 0.0;  // centre of mass ahead: equal rotors lift the nose, -y
  EXPECT_NEAR(torque({900, 900, 900, 900}).y(), 0.01 * 4 * rotor_thrust(t, 900, Vector3d::Zero()).thrust_N, 1e-12);
}

TEST(ModelTrueLoads, DragIsThatOfEquationsFourAndFive) {
  State x;
  x.v_W_m_s = {8.5, -2.0, 1.0};
  const Loads l = loads(kTruth, x, {900, 950, 1000, 1050});
  double sum = 0.0;
  for (double w : {900.0, 950.0, 1000.0, 1050.0}) sum += rotor_thrust(kTruth, w, x.v_W_m_s).thrust_N;
  EXPECT_NEAR(l.force_B_N.x(), -sum * 0.0175 * 8.5 - 0.0055 * 8.5 * 8.5, 1e-12);
  EXPECT_NEAR(l.force_B_N.y(), sum * 0.0175 * 2.0 + 0.0055 * 2.0 * 2.0, 1e-12);
  EXPECT_NEAR(l.force_B_N.z(), sum - 0.0185, 1e-12);
}

TEST(ModelTrueMotion, KeepsEnergyAndAngularMomentumOfABodyTumblingWithoutTorqueFor5Seconds) {
  Truth t;  // equal thrusts about the centre of mass give no torque
  t.com_offset_m.setZero();
  State x;
  x.omega_B_rad_s = {4.0, 0.3, 5.0};
  const auto momentum = [&](const State& s) { return Vector3d(s.q_WB * t.inertia_kg_m2.cwiseProduct(s.omega_B_rad_s)); };
  const auto spin_energy = [&](const State& s) { return 0.5 * s.omega_B_rad_s.dot(t.inertia_kg_m2.cwiseProduct(s.omega_B_rad_s)); };
  const Vector3d L0 = momentum(x);
  const double E0 = spin_energy(x), h = 0.25e-3;
  const RotorSpeeds w{900, 900, 900, 900};
  double most = 0.0;
  for (int i = 0; i < 20000; ++i) {
    x.v_W_m_s.setZero();  // held in place: where it goes is another test's
    x = advance(t, x, w, w, h);
    most = std::max(most, std::fabs(x.omega_B_rad_s.y()));
  }
  EXPECT_GT(most, 1.0);  // it does tumble
  EXPECT_NEAR(spin_energy(x) / E0, 1.0, 1e-6);
  EXPECT_LT((momentum(x) - L0).norm() / L0.norm(), 1e-5);
  EXPECT_NEAR(x.q_WB.norm(), 1.0, 1e-14);
}

TEST(ModelTrueMotion, WorkOfTheForcesIsTheEnergyGainedInAQuietFlight) {
  // Body frame power F·v and τ·Ω summed over the log's 5 ms against the change of mechanical energy, in the fastest manoeuvre.
  const ModelTrueFlight f = fly(kTruth, quiet(Manoeuvre::rotation, 6.0));
  const auto energy = [&](const State& s) {
    return 0.5 * 0.682 * s.v_W_m_s.squaredNorm() + 0.682 * kGravity_m_s2 * s.p_W_m.z() +
           0.5 * s.omega_B_rad_s.dot(kTruth.inertia_kg_m2.cwiseProduct(s.omega_B_rad_s));
  };
  const auto power = [&](std::size_t k) {
    const State& s = f.states[k];
    const Loads l = loads(kTruth, s, f.record.rotor_omega_rad_s.value[5 * k]);
    return l.force_B_N.dot(s.q_WB.conjugate() * s.v_W_m_s) + l.torque_B_N_m.dot(s.omega_B_rad_s);
  };
  double work = 0.0, turned_over = 0.0;
  for (std::size_t k = 1; k < f.states.size(); ++k) {
    work += 0.005 * (power(k - 1) + power(k)) / 2;
    turned_over += 0.005 * std::fabs(power(k));
  }
  EXPECT_GT(turned_over, 5.0);  // J
  EXPECT_NEAR(work, energy(f.states.back()) - energy(f.states.front()), 2e-3 * turned_over);
}

TEST(ModelTrueMotion, ErrorFallsFourfoldWhenTheStepIsHalvedAndIsBelowOneMicrometreAndMicroradian) {
  // Without noise; the same speeds for every step size: commands would see the error otherwise.
  const auto end_of = [&](int steps_per_ms) {
    State x;
    x.v_W_m_s = {3.0, 1.0, 0.5};
    const double h = 1e-3 / steps_per_ms;
    const auto speeds = [](double t) {
      return RotorSpeeds{940 + 200 * std::sin(12 * t), 930 + 150 * std::sin(9 * t), 950 - 180 * std::sin(10 * t),
                         935 - 160 * std::sin(11 * t)};
    };
    for (int i = 0; i < 500 * steps_per_ms; ++i) x = advance(kTruth, x, speeds(i * h), speeds((i + 0.5) * h), h);
    return x;
  };
  const State fine = end_of(32), a = end_of(2), b = end_of(4);
  const auto turn = [](const State& s, const State& r) { return (2.0 * (r.q_WB.conjugate() * s.q_WB).vec()).norm(); };
  EXPECT_NEAR((a.p_W_m - fine.p_W_m).norm() / (b.p_W_m - fine.p_W_m).norm(), 4.0, 0.2);
  EXPECT_NEAR(turn(a, fine) / turn(b, fine), 4.0, 0.2);
  EXPECT_LT((b.p_W_m - fine.p_W_m).norm(), 1e-6);
  EXPECT_LT(turn(b, fine), 1e-6);
}

// Standard deviation, per axis, of what one pose interval's motion has beyond the noise-free model.
struct StepNoise {
  double velocity, rate, position_given_velocity;
};
StepNoise step_noise(const FlightSettings& s) {
  const ModelTrueFlight f = fly(kTruth, s);
  double vv = 0, ww = 0, pp = 0;
  std::size_t n = 0;
  for (std::size_t k = 1; k < f.states.size(); ++k) {
    State x = f.states[k - 1];
    for (std::size_t ms = 0; ms < 5; ++ms) {  // the model alone, from one logged instant to the next
      const RotorSpeeds& w0 = f.record.rotor_omega_rad_s.value[5 * (k - 1) + ms];
      const RotorSpeeds& w1 = f.record.rotor_omega_rad_s.value[5 * (k - 1) + ms + 1];
      RotorSpeeds middle;
      for (std::size_t i = 0; i < 4; ++i) middle[i] = (w0[i] + w1[i]) / 2;
      x = advance(kTruth, x, w0, middle, 1e-3);
    }
    const Vector3d dv = f.states[k].v_W_m_s - x.v_W_m_s;
    vv += dv.squaredNorm();
    ww += (f.states[k].omega_B_rad_s - x.omega_B_rad_s).squaredNorm();
    pp += (f.states[k].p_W_m - x.p_W_m - 0.0025 * dv).squaredNorm();
    n += 3;
  }
  const auto rms = [&](double sum) { return std::sqrt(sum / static_cast<double>(n)); };
  return {rms(vv), rms(ww), rms(pp)};
}

TEST(ModelTrueNoise, HasTheDensitiesAskedForWithin3PercentMeasuredFromTheStates) {
  FlightSettings s;
  s.manoeuvre = Manoeuvre::rotation;
  const StepNoise n = step_noise(s);
  EXPECT_NEAR(n.velocity / std::sqrt(0.005), 0.03, 0.03 * 0.03);  // m/s²/√Hz; 12 000 numbers: 0.65 % standard error
  EXPECT_NEAR(n.rate / std::sqrt(0.005), 0.3, 0.03 * 0.3);        // rad/s²/√Hz
  // Position beyond half the velocity's share: q √(dt³/12), the other independent part of integrated white noise.
  EXPECT_NEAR(n.position_given_velocity, 0.03 * std::sqrt(0.005 * 0.005 * 0.005 / 12.0), 0.03 * 6e-6);
  s.steps_per_ms = 8;
  EXPECT_NEAR(step_noise(s).rate / std::sqrt(0.005), 0.3, 0.03 * 0.3) << "the density must not depend on the fine step";
}

TEST(ModelTrueNoise, PosesScatterBy2MillimetresAnd2MilliradiansAboutTheMountedSensor) {
  const ModelTrueFlight f = fly(kTruth, {.manoeuvre = Manoeuvre::horizontal});
  double pp = 0, rr = 0;
  Vector3d mean = Vector3d::Zero();
  for (std::size_t k = 0; k < f.states.size(); ++k) {
    const State& x = f.states[k];
    const Vector3d e = f.record.pose.value[k].p_W_m - x.p_W_m - x.q_WB * kTruth.r_BS_m;
    pp += e.squaredNorm();
    mean += e / static_cast<double>(f.states.size());
    rr += 4.0 * ((x.q_WB * kTruth.q_BS).conjugate() * f.record.pose.value[k].q_WS).vec().squaredNorm();
  }
  const double n = 3.0 * static_cast<double>(f.states.size());
  EXPECT_NEAR(std::sqrt(pp / n), 0.002, 0.00004);
  EXPECT_NEAR(std::sqrt(rr / n), 0.002, 0.00004);
  EXPECT_LT(mean.norm(), 0.00015);
}

TEST(ModelTrueNoise, AccelerometerReadsTheChangeOfVelocityAndTheGyroTheRate) {
  FlightSettings s;
  s.manoeuvre = Manoeuvre::horizontal;
  s.duration_s = 5.0;
  s.imu_every_ms = 1;
  s.gyro_sigma_rad_s = s.accel_sigma_m_s2 = 0.0;
  s.gyro_bias_rad_s = {0.01, -0.02, 0.03};
  const ModelTrueFlight f = fly(kTruth, s);
  ASSERT_EQ(f.record.accel_B_m_s2.size(), 5000u);
  Vector3d v = Vector3d::Zero();  // integrated in the world with the attitude of the nearest pose
  for (std::size_t i = 0; i < 5000; ++i) {
    const Quaterniond& q0 = f.states[i / 5].q_WB;
    const Quaterniond& q1 = f.states[i / 5 + 1].q_WB;
    const double a = (static_cast<double>(i % 5) + 0.5) / 5.0;
    v += 1e-3 * (q0.slerp(a, q1) * f.record.accel_B_m_s2.value[i] - Vector3d(0, 0, kGravity_m_s2));
  }
  EXPECT_LT((v - f.states.back().v_W_m_s).norm(), 2e-3);
  EXPECT_LT((f.record.gyro_B_rad_s.value.back() - f.states.back().omega_B_rad_s - s.gyro_bias_rad_s).norm(), 1e-12);
}

TEST(ModelTrueFlights, ReachTheSpeedsAndRatesOfThePapersThreeFlights) {
  const auto flights = fly_identification_set(kTruth, {});
  ASSERT_EQ(flights.size(), 3u);
  double up = 0, down = 0, level = 0;
  Vector3d rate = Vector3d::Zero();
  for (const State& x : flights[0].states) {
    up = std::max(up, x.v_W_m_s.z());
    down = std::min(down, x.v_W_m_s.z());
    EXPECT_LT(x.v_W_m_s.head<2>().norm(), 0.3);
  }
  for (const State& x : flights[1].states) {
    level = std::max(level, x.v_W_m_s.head<2>().norm());
    EXPECT_LT(std::fabs(x.p_W_m.z()), 0.3);
  }
  for (const State& x : flights[2].states) rate = rate.cwiseMax(x.omega_B_rad_s.cwiseAbs());
  EXPECT_NEAR(up, 3.5, 0.2);     // m/s
  EXPECT_NEAR(down, -3.5, 0.2);  // m/s
  EXPECT_NEAR(level, 10.5, 0.2);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(rate[i], 6.4, 0.3) << "rad/s about axis " << i;
  for (const auto& f : flights) {
    EXPECT_GT(f.least_through_flow_m_s, 1.0) << f.record.name;  // far from where eq. 1 and 2 end
    EXPECT_EQ(f.record.pose.size(), 4001u);
    EXPECT_EQ(f.record.rotor_omega_rad_s.size(), 20001u);
    EXPECT_DOUBLE_EQ(f.record.pose.t_s.back(), 20.0);
  }
}

TEST(ModelTrueFlights, RepeatBitByBitAndDifferWithTheSeed) {
  const FlightSettings s{.manoeuvre = Manoeuvre::vertical, .seed = 7, .duration_s = 1.0};
  FlightSettings other = s;
  other.seed = 8;
  const auto a = fly(kTruth, s), b = fly(kTruth, s), c = fly(kTruth, other);
  EXPECT_EQ(a.record.pose.value.back().p_W_m, b.record.pose.value.back().p_W_m);
  EXPECT_EQ(a.record.rotor_omega_rad_s.value.back(), b.record.rotor_omega_rad_s.value.back());
  EXPECT_NE(a.record.pose.value.back().p_W_m, c.record.pose.value.back().p_W_m);
}

TEST(ModelTrueFlights, StampPosesAndRotorSpeedsLateByTheDelaysOfTheTruth) {
  Truth late = kTruth;
  late.pose_delay_s = 0.004;
  late.rotor_delay_s = 0.0015;
  const FlightSettings s{.manoeuvre = Manoeuvre::vertical, .seed = 7, .duration_s = 1.0, .rotor_log_every_ms = 5};
  const auto a = fly(kTruth, s), b = fly(late, s);
  EXPECT_EQ(a.record.pose.value[100].p_W_m, b.record.pose.value[100].p_W_m);
  EXPECT_DOUBLE_EQ(b.record.pose.t_s[100], 0.504);
  ASSERT_EQ(b.record.rotor_omega_rad_s.size(), 201u);
  EXPECT_DOUBLE_EQ(b.record.rotor_omega_rad_s.t_s[100], 0.5015);
}

}  // namespace
}  // namespace rotorloop::model_true
