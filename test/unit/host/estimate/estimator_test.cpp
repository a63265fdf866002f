// The estimator against known motion: what it must reach with the reference sensors, and each protection together with the
// damage done without it. Motion here is prescribed in closed form, so that no controller hides an error.
#include "host/estimate/estimator.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <numbers>

#include "host/base/random.hpp"

namespace rotorloop::host {
namespace {

using V3 = Eigen::Vector3d;
using Q = Eigen::Quaterniond;

// Back and forth along x while nodding and turning, at rest for the first two seconds.
struct Motion {
  double amplitude_m = 3.0, rate_rad_s = 1.8, nod_rad = 0.8, turn_rad = 1.5;

  double ramp(double t) const { return t < 2.0 ? 0.0 : t - 2.0; }
  V3 p(double t) const {
    return {amplitude_m * (1.0 - std::cos(rate_rad_s * ramp(t))), 0.5 * amplitude_m * std::pow(std::sin(0.5 * rate_rad_s * ramp(t)), 4),
            2.0};
  }
  Q q(double t) const {
    const double s = std::pow(std::sin(0.5 * rate_rad_s * ramp(t)), 2), c = std::pow(std::sin(0.35 * rate_rad_s * ramp(t)), 2);
    return Q(Eigen::AngleAxisd(turn_rad * c, V3::UnitZ())) * Q(Eigen::AngleAxisd(nod_rad * s, V3::UnitY())) *
           Q(Eigen::AngleAxisd(0.4 * nod_rad * c, V3::UnitX()));
  }
  // Numerical derivatives of the closed form: independent of how the estimator integrates.
  static constexpr double kH = 1e-4;
  V3 v(double t) const { return (p(t + kH) - p(t - kH)) / (2 * kH); }
  V3 a(double t) const { return (p(t + kH) - 2 * p(t) + p(t - kH)) / (kH * kH); }
  V3 w(double t) const { return (q(t - kH).conjugate() * q(t + kH)).vec() / kH; }
};

VehicleModel vehicle() {
  VehicleModel m;
  m.pose_sensor_p_BS_m = {0.0901, 0.0063, 0.0142};
  m.pose_sensor_q_BS = Q(0.9975, -0.0241, -0.0122, 0.0646).normalized();
  return m;
}

struct Scene {
  Motion motion;
  EstimatorConfig config;
  VehicleModel nominal = vehicle();
  bool noise = true;
  double drift_m = 0.005;
  double stamp_late_s = 0.0;  // the sensor's stamps lie by this much
  double duration_s = 14.0;
  V3 gyro_bias{0.005, -0.004, 0.003}, accel_bias{0.05, -0.04, 0.03};
  // Changes a pose on its way, or drops it (false).
  std::function<bool(double t, PoseSample&)> meddle = [](double, PoseSample&) { return true; };
};

struct Figures {
  double excess_rms_m = 0, v_rms_m_s = 0, q_rms_rad = 0, max_p_m = 0, final_p_m = 0;
  V3 gyro_bias, accel_bias;
  EstimatorCounters counters;
  double invalid_s = 0;  // after the start
  Eigen::Matrix<double, 15, 1> sigma;
  StateEstimate last;
};

Figures run(const Scene& s) {
  Estimator estimator(s.config, s.nominal);
  const VehicleModel truth = vehicle();
  const RandomStream r(11, 3);
  std::uint64_t draw = 0;
  const auto gauss = [&](double sigma) {
    const V3 v(r.gaussian(draw), r.gaussian(draw + 1), r.gaussian(draw + 2));
    draw += 3;
    return V3(s.noise ? V3(sigma * v) : V3::Zero());
  };
  struct Late {
    PoseSample sample;
    double arrives_s;
  };
  std::deque<Late> air;
  V3 drift = gauss(s.drift_m);
  Figures f;
  int n = 0;
  const int steps = static_cast<int>(s.duration_s * 1000);
  for (int k = 0; k < steps; ++k) {
    const double t = 1e-3 * k;
    const V3 p = s.motion.p(t), v = s.motion.v(t), w = s.motion.w(t);
    const Q q = s.motion.q(t);
    if (k % 5 == 0) {
      PoseSample z;
      z.time_us = 1000LL * k + static_cast<std::int64_t>(std::lround(s.stamp_late_s * 1e6));
      z.p_W_m = p + q * truth.pose_sensor_p_BS_m + drift + gauss(0.002);
      z.v_W_m_s = v + q * w.cross(truth.pose_sensor_p_BS_m) + gauss(0.05);
      const V3 e = gauss(0.002);
      z.q_WS = (q * truth.pose_sensor_q_BS * Q(1.0, 0.5 * e.x(), 0.5 * e.y(), 0.5 * e.z())).normalized();
      const double keep = std::exp(-0.005 / 15.0);
      drift = keep * drift + gauss(s.drift_m * std::sqrt(1 - keep * keep));
      double arrives = t + 0.012 + 0.006 * r.uniform(draw++);
      if (!air.empty()) arrives = std::fmax(arrives, air.back().arrives_s);
      if (s.meddle(t, z)) air.push_back({z, arrives});
    }
    while (!air.empty() && air.front().arrives_s <= t) {
      estimator.on_pose(air.front().sample);
      air.pop_front();
    }
    ImuSample imu;
    imu.time_us = 1000LL * k;
    const double shake = s.noise ? std::sin(940.0 * t) : 0.0;
    imu.gyro_B_rad_s = w + s.gyro_bias + gauss(0.01) + V3(0.05, 0.05, 0.05) * shake;
    imu.accel_B_m_s2 = q.conjugate() * (s.motion.a(t) + V3(0, 0, kGravity_m_s2)) + s.accel_bias + gauss(0.15) + V3(1, 1, 1) * shake;
    const StateEstimate& e = estimator.on_imu(imu);
    if (t > 0.5) f.invalid_s += e.valid ? 0.0 : 1e-3;
    const double error = (e.p_W_m - p - drift).norm();
    if (t > 3.0) {
      f.excess_rms_m += error * error;
      f.max_p_m = std::fmax(f.max_p_m, error);
      f.v_rms_m_s += (e.v_W_m_s - v).squaredNorm();
      f.q_rms_rad += 4.0 * (q.conjugate() * e.q_WB).vec().squaredNorm();
      ++n;
    }
    f.final_p_m = error;
    f.last = e;
  }
  for (double* x : {&f.excess_rms_m, &f.v_rms_m_s, &f.q_rms_rad}) *x = std::sqrt(*x / (3.0 * n));
  f.gyro_bias = estimator.gyro_bias_rad_s();
  f.accel_bias = estimator.accel_bias_m_s2();
  f.sigma = estimator.sigma();
  f.counters = estimator.counters();
  return f;
}

Scene without_noise() {
  Scene s;
  s.noise = false;
  s.gyro_bias.setZero();
  s.accel_bias.setZero();
  return s;
}

TEST(Estimator, WithReferenceSensorsAddsAtMost2mmToTheDriftAnd30mmPerSecondAnd5mrad) {
  const Figures f = run({});
  EXPECT_LT(f.excess_rms_m, 0.002);
  EXPECT_LT(f.v_rms_m_s, 0.03);
  EXPECT_LT(f.q_rms_rad, 0.005);
  EXPECT_EQ(f.counters.poses_gated, 0u);
  EXPECT_EQ(f.counters.resets, 0u);
  EXPECT_EQ(f.invalid_s, 0.0);
}

TEST(Estimator, WithoutNoiseFollowsTheMotionToTenthsOfAMillimetre) {
  const Figures f = run(without_noise());
  EXPECT_LT(f.max_p_m, 2e-4);
  EXPECT_LT(f.v_rms_m_s, 2e-3);
  EXPECT_LT(f.q_rms_rad, 3e-4);
}

TEST(Estimator, FindsTheBiasesOfTheImu) {
  const Scene s;
  const Figures f = run(s);
  EXPECT_LT((f.gyro_bias - s.gyro_bias).norm(), 0.002);
  EXPECT_LT((f.accel_bias - s.accel_bias).norm(), 0.02);
}

TEST(Estimator, TakingLatePosesAsCurrentCostsCentimetres) {
  Scene s;
  s.config.compensate_latency = false;
  const Figures f = run(s);
  EXPECT_GT(f.excess_rms_m, 0.02);  // 15 ms at 5.4 m/s is 81 mm at the fastest point
  EXPECT_GT(f.v_rms_m_s, 0.03);
}

TEST(Estimator, StampOffsetParameterUndoesLyingStamps) {
  Scene s = without_noise();
  s.stamp_late_s = 0.004;
  const double ignored = run(s).excess_rms_m;
  s.config.pose_stamp_offset_s = 0.004;
  const double undone = run(s).excess_rms_m;
  EXPECT_GT(ignored, 0.004);  // 4 ms of up to 5.4 m/s
  EXPECT_LT(undone, 2e-4);
}

TEST(Estimator, SensorOffsetAndRotationComeFromTheVehicleFile) {
  Scene s = without_noise();
  s.nominal.pose_sensor_p_BS_m.setZero();
  EXPECT_GT(run(s).excess_rms_m, 0.02);
  s = without_noise();
  s.nominal.pose_sensor_q_BS = Q::Identity();
  EXPECT_GT(run(s).q_rms_rad, 0.03);
}

TEST(Estimator, OneOutlierOfOneMetreIsRefusedAndWouldThrowTheStateWithoutTheGate) {
  Scene s;
  s.meddle = [](double t, PoseSample& z) {
    if (std::fabs(t - 6.0) < 1e-6) z.p_W_m.x() += 1.0;
    return true;
  };
  const Figures kept = run(s);
  EXPECT_EQ(kept.counters.poses_gated, 1u);
  EXPECT_LT(kept.max_p_m, 0.01);
  s.config.gate_sigma = 1e9;
  EXPECT_GT(run(s).max_p_m, 0.03);
}

TEST(Estimator, PersistentJumpIsAcceptedAfterThePatienceAndOnlyOnce) {
  Scene s;
  s.drift_m = 0.0;
  s.meddle = [](double t, PoseSample& z) {
    if (t >= 6.0) z.p_W_m.y() += 0.4;
    return true;
  };
  const Figures f = run(s);
  EXPECT_EQ(f.counters.resets, 1u);
  EXPECT_NEAR(static_cast<double>(f.counters.poses_gated), 0.15 * 200.0, 2.0);
  EXPECT_NEAR(f.final_p_m, 0.4, 0.005);  // against the truth: the sensor's new frame is followed
  EXPECT_LT(f.v_rms_m_s, 0.03);          // velocity never saw a jump
  s.config.gate_patience_s = 1e9;
  const Figures stubborn = run(s);  // flies on the IMU alone until its own uncertainty has grown to the size of the jump
  EXPECT_EQ(stubborn.counters.resets, 0u);
  EXPECT_GT(stubborn.counters.poses_gated, 100u);
}

TEST(Estimator, DropoutEndsValidityAfterAQuarterSecondAndEndsWithThePosesReturn) {
  Scene s;
  s.meddle = [](double t, PoseSample&) { return t < 6.0 || t >= 7.0; };
  const Figures f = run(s);
  EXPECT_NEAR(f.invalid_s, 1.0 - 0.25, 0.03);
  EXPECT_TRUE(f.last.valid);
  EXPECT_LT(f.final_p_m, 0.01);
  EXPECT_LT(f.max_p_m, 0.15);  // one second on the IMU alone, longer than its buffer
}

TEST(Estimator, PosesOutOfOrderOldFutureOrNotFiniteAreCountedAndHarmless) {
  Scene s;
  s.duration_s = 10.0;
  s.meddle = [](double t, PoseSample& z) {
    const auto n = static_cast<int>(std::lround(t * 200.0));
    if (t < 3.0) return true;
    if (n % 100 == 0) z.time_us -= 40'000;       // before the horizon
    if (n % 100 == 20) z.time_us += 10'000'000;  // of a clock that runs ahead
    if (n % 100 == 40) z.p_W_m.z() = std::numeric_limits<double>::quiet_NaN();
    if (n % 100 == 60) z.q_WS.coeffs() *= 0.5;  // no rotation
    if (n % 100 == 80) z.time_us -= 5'000'000;  // older than the buffer
    return true;
  };
  const Figures f = run(s);
  EXPECT_EQ(f.counters.poses_out_of_order, 14u);
  EXPECT_EQ(f.counters.poses_from_future, 14u);
  EXPECT_EQ(f.counters.poses_not_finite, 28u);
  EXPECT_EQ(f.counters.poses_too_old, 14u);
  EXPECT_LT(f.excess_rms_m, 0.002);
}

TEST(Estimator, ImuSamplesThatRepeatOrAreNotFiniteAreRefused) {
  Estimator e({}, vehicle());
  ImuSample good;
  good.accel_B_m_s2 = {0, 0, kGravity_m_s2};
  for (int k = 0; k < 10; ++k) {
    good.time_us = 1000 * k;
    e.on_imu(good);
  }
  e.on_imu(good);  // the same time again
  ImuSample bad = good;
  bad.time_us = 20'000;
  bad.gyro_B_rad_s.x() = std::numeric_limits<double>::infinity();
  e.on_imu(bad);
  EXPECT_EQ(e.counters().imu_rejected, 2u);
  EXPECT_EQ(e.estimate().time_us, 9000);
  EXPECT_TRUE(e.estimate().w_B_rad_s.allFinite());
}

TEST(Estimator, IsInvalidUntilTenPosesHaveArrived) {
  Estimator e({}, vehicle());
  ImuSample imu;
  imu.accel_B_m_s2 = {0, 0, kGravity_m_s2};
  PoseSample z;
  z.q_WS = vehicle().pose_sensor_q_BS;
  int poses = 0;
  for (int k = 0; k < 60; ++k) {
    imu.time_us = 1000 * k;
    e.on_imu(imu);
    if (k % 5 == 0) {
      z.time_us = imu.time_us;
      e.on_pose(z);
      ++poses;
    }
    EXPECT_EQ(e.estimate().valid, poses > 10 || (poses == 10 && k % 5 != 0)) << k;
  }
  EXPECT_NEAR(e.estimate().p_W_m.x(), -0.0901, 1e-6);  // the centre of mass, not the sensor
}

TEST(Estimator, SameSamplesGiveTheSameBits) {
  const StateEstimate a = run({}).last, b = run({}).last;
  EXPECT_EQ(a.p_W_m, b.p_W_m);
  EXPECT_EQ(a.q_WB.coeffs(), b.q_WB.coeffs());
}

TEST(Estimator, SigmaMatchesTheErrorItPromises) {
  Scene s;
  s.drift_m = 0.0;
  s.config.position_noise_m = 0.002;  // the sensor's own figures
  s.config.attitude_noise_rad = 0.002;
  const Figures f = run(s);
  for (int part = 0; part < 3; ++part) {
    const double promised = f.sigma.segment<3>(3 * part).norm() / std::sqrt(3.0);
    const double reached = std::array{f.excess_rms_m, f.v_rms_m_s, f.q_rms_rad}[static_cast<std::size_t>(part)];
    EXPECT_LT(reached, 2.0 * promised) << "part " << part;
    EXPECT_GT(reached, 0.2 * promised) << "part " << part;
  }
}

}  // namespace
}  // namespace rotorloop::host
