// A small quadrotor of its own, written apart from the code under test, so that controller and estimator can be flown in a unit
// test: rigid body, lagging rotors whose thrust follows blade and momentum balance, drag, and the reference sensors with their
// noise, drift and latency. It shares no equation with host/; the large plant of sim/ is another thing again.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <numbers>

#include "host/base/random.hpp"
#include "host/control/controller.hpp"
#include "host/control/trajectory.hpp"
#include "host/estimate/estimator.hpp"

namespace rotorloop::test {

using V3 = Eigen::Vector3d;
using Q = Eigen::Quaterniond;

struct QuadTruth {
  double mass = 0.682;
  V3 inertia{2.41e-3, 3.42e-3, 5.22e-3};
  V3 com{0.0014, 0.000177, 0.0};
  double half_span = 0.0885;
  double k1 = 3.119e-6, k2 = -1.547e-4, radius = 0.0635, density = 1.2;
  double c_q = 3.10e-8;
  double rotor_inertia = 9.4e-6;  // reaction torque of spinning up; 0 switches it off
  double rotor_drag = 0.0175, body_drag_xy = 0.0055, body_drag_z = 0.0185;
  double motor_lag_s = 0.010;
  int command_delay_ms = 1;
  double thrust_scale = 1.0;
};

struct SensorTruth {
  bool noise = true, drift = true;
  double latency_s = 0.015, jitter_s = 0.003;
  double p_noise = 0.002, q_noise = 0.002, v_noise = 0.05, drift_m = 0.005, drift_tau_s = 15.0;
  V3 offset{0.0901, 0.0063, 0.0142};
  Q rotation = Q(0.9975, -0.0241, -0.0122, 0.0646).normalized();
  double gyro_noise = 0.01, accel_noise = 0.15;
  V3 gyro_bias{0.005, -0.004, 0.003}, accel_bias{0.05, -0.04, 0.03};
  double gyro_vibration = 0.05, accel_vibration = 1.0;  // amplitudes at rotor frequency
};

// One rotor: thrust from T = k1 w² + k2 w u and T = 2 rho A (u - climb) |velocity through the disk|, by bisection on u.
inline double rotor_thrust(const QuadTruth& t, double w, double climb, double across) {
  if (w < 1.0) return 0.0;
  const double area2 = 2.0 * t.density * std::numbers::pi * t.radius * t.radius;
  const auto surplus = [&](double u) {  // momentum thrust minus blade thrust: rises with u in normal flight
    return area2 * (u - climb) * std::sqrt(u * u + across * across) - (t.k1 * w * w + t.k2 * w * u);
  };
  double a = std::fmin(0.0, climb), b = 60.0;
  for (int i = 0; i < 30; ++i) {  // to 6e-8 m/s
    const double m = 0.5 * (a + b);
    (surplus(m) > 0.0 ? b : a) = m;
  }
  return t.k1 * w * w + t.k2 * w * 0.5 * (a + b);
}

class Quad {
 public:
  explicit Quad(const QuadTruth& truth) : t_(truth) {}
  V3 p = V3::Zero(), v = V3::Zero(), w = V3::Zero(), specific_force = V3::Zero();
  Q q = Q::Identity();
  std::array<double, 4> speed{};
  double drag_N = 0.0;

  // dt of about 0.25 ms: velocity first, then position (symplectic Euler).
  void step(const std::array<double, 4>& command, double dt) {
    const std::array<double, 4> x{t_.half_span, -t_.half_span, t_.half_span, -t_.half_span};
    const std::array<double, 4> y{-t_.half_span, t_.half_span, t_.half_span, -t_.half_span};
    const std::array<double, 4> turn{-1.0, -1.0, 1.0, 1.0};
    const V3 vb = q.conjugate() * v;
    double lift = 0.0, mx = 0.0, my = 0.0, mz = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double rate = (command[i] - speed[i]) / t_.motor_lag_s;
      speed[i] += rate * dt;
      const double ax = x[i] - t_.com.x(), ay = y[i] - t_.com.y();
      const double vx = vb.x() - w.z() * ay, vy = vb.y() + w.z() * ax, vz = vb.z() + w.x() * ay - w.y() * ax;
      const double thrust = t_.thrust_scale * rotor_thrust(t_, speed[i], vz, std::hypot(vx, vy));
      lift += thrust;
      mx += ay * thrust;
      my -= ax * thrust;
      mz += turn[i] * (t_.c_q * speed[i] * speed[i] + t_.rotor_inertia * rate);
    }
    const V3 drag(-(t_.rotor_drag * lift + t_.body_drag_xy * std::fabs(vb.x())) * vb.x(),
                  -(t_.rotor_drag * lift + t_.body_drag_xy * std::fabs(vb.y())) * vb.y(), -t_.body_drag_z * std::fabs(vb.z()) * vb.z());
    drag_N = drag.norm();
    specific_force = (V3(0, 0, lift) + drag) / t_.mass;
    v += (q * specific_force - V3(0, 0, 9.80665)) * dt;
    p += v * dt;
    const V3 momentum = t_.inertia.cwiseProduct(w);
    w += (V3(mx, my, mz) - w.cross(momentum)).cwiseQuotient(t_.inertia) * dt;
    const double angle = w.norm() * dt;
    if (angle > 1e-12) q = (q * Q(Eigen::AngleAxisd(angle, w.normalized()))).normalized();
  }

  V3 point(const V3& offset) const { return p + q * offset; }
  V3 point_velocity(const V3& offset) const { return v + q * w.cross(offset); }

 private:
  QuadTruth t_;
};

struct FlightSetup {
  QuadTruth plant;
  SensorTruth sensors;
  host::EstimatorConfig estimator;
  host::VehicleModel model;
  host::ControllerConfig controller;
  bool perfect_state = false;  // the controller sees the truth
  std::uint64_t seed = 1;
};

struct FlightFigures {
  double mean_error_m = 0.0, mean_error_z_m = 0.0, max_error_m = 0.0;  // truth against set-point, first to last motion
  double est_p_rms_m = 0.0, est_v_rms_m_s = 0.0, est_q_rms_rad = 0.0;  // estimate against truth
  double est_p_excess_rms_m = 0.0;                                     // estimate against truth plus the sensor's drift
  double drift_rms_m = 0.0;
  double yaw_rms_rad = 0.0, yaw_max_rad = 0.0;  // heading of the truth against the set-point
  double max_drag_N = 0.0, max_rate_rad_s = 0.0;
  double speed_ripple_rad_s = 0.0;  // rms step of the command from one ms to the next
  double iterations = 0.0;
  host::ControllerCounters controller;
  host::EstimatorCounters estimator;
  bool crashed = false;
};

// White and drifting noise of one three-axis sensor channel.
struct Noise {
  RandomStream stream;
  V3 at(std::uint64_t k, double sigma) const {
    return sigma * V3(stream.gaussian(3 * k), stream.gaussian(3 * k + 1), stream.gaussian(3 * k + 2));
  }
};

inline FlightFigures fly(const FlightSetup& s, const host::Trajectory& trajectory) {
  Quad quad(s.plant);
  const host::Controller controller(s.model, s.controller);
  host::ControllerState state;
  host::Estimator estimator(s.estimator, s.model);
  const host::Setpoint start = trajectory.at(0.0);
  quad.p = start.p_W_m;
  quad.speed.fill(controller.hover_omega_rad_s());
  std::deque<std::array<double, 4>> commands(static_cast<std::size_t>(s.plant.command_delay_ms) + 1, quad.speed);

  const Noise p_noise{{s.seed, 1}}, q_noise{{s.seed, 2}}, v_noise{{s.seed, 3}}, drift_noise{{s.seed, 4}}, gyro{{s.seed, 5}},
      accel{{s.seed, 6}};
  const RandomStream latency{s.seed, 7};
  struct Late {
    host::PoseSample sample;
    double arrives_s;
  };
  std::deque<Late> air;
  V3 drift = s.sensors.drift ? drift_noise.at(1u << 20, s.sensors.drift_m) : V3::Zero();

  FlightFigures f;
  const double t0 = trajectory.first_motion_s(), t1 = trajectory.last_motion_s();
  const int steps = static_cast<int>(trajectory.duration_s() * 1000.0);
  int counted = 0;
  double phase = 0.0;
  std::array<double, 4> last_command = quad.speed;
  for (int k = 0; k < steps; ++k) {
    const double now_s = 1e-3 * k;
    const std::int64_t now_us = 1000LL * k;
    const auto kk = static_cast<std::uint64_t>(k);
    // Pose message, measured now, on its way.
    if (k % 5 == 0) {
      host::PoseSample z;
      z.time_us = now_us;
      z.p_W_m = quad.point(s.sensors.offset) + drift;
      z.v_W_m_s = quad.point_velocity(s.sensors.offset);
      z.q_WS = quad.q * s.sensors.rotation;
      if (s.sensors.noise) {
        z.p_W_m += p_noise.at(kk, s.sensors.p_noise);
        z.v_W_m_s += v_noise.at(kk, s.sensors.v_noise);
        const V3 e = q_noise.at(kk, s.sensors.q_noise);
        z.q_WS = (z.q_WS * Q(1.0, 0.5 * e.x(), 0.5 * e.y(), 0.5 * e.z())).normalized();
      }
      double arrives = now_s + s.sensors.latency_s + s.sensors.jitter_s * (2.0 * latency.uniform(kk) - 1.0);
      if (!air.empty()) arrives = std::fmax(arrives, air.back().arrives_s);
      air.push_back({z, arrives});
      const double keep = std::exp(-0.005 / s.sensors.drift_tau_s);
      if (s.sensors.drift) drift = keep * drift + drift_noise.at(kk, s.sensors.drift_m * std::sqrt(1.0 - keep * keep));
    }
    while (!air.empty() && air.front().arrives_s <= now_s) {
      estimator.on_pose(air.front().sample);
      air.pop_front();
    }
    host::ImuSample imu;
    imu.time_us = now_us;
    imu.gyro_B_rad_s = quad.w;
    imu.accel_B_m_s2 = quad.specific_force;
    if (k == 0) imu.accel_B_m_s2 = V3(0, 0, 9.80665);
    if (s.sensors.noise) {
      phase += quad.speed[0] * 1e-3;
      const V3 shake(std::sin(phase), std::cos(phase), std::sin(phase + 1.0));
      imu.gyro_B_rad_s += s.sensors.gyro_bias + gyro.at(kk, s.sensors.gyro_noise) + s.sensors.gyro_vibration * shake;
      imu.accel_B_m_s2 += s.sensors.accel_bias + accel.at(kk, s.sensors.accel_noise) + s.sensors.accel_vibration * shake;
    }
    const host::StateEstimate& estimated = estimator.on_imu(imu);
    host::StateEstimate used = estimated;
    if (s.perfect_state) {
      used.p_W_m = quad.p;
      used.v_W_m_s = quad.v;
      used.q_WB = quad.q;
      used.w_B_rad_s = quad.w;
      used.valid = true;
    }
    const host::Setpoint setpoint = trajectory.at(now_s);
    const host::Command command = controller.step(state, used, setpoint);
    commands.push_back(command.omega_rad_s);
    commands.pop_front();
    const std::array<double, 4> acting = commands.front();
    for (int i = 0; i < 4; ++i) quad.step(acting, 0.25e-3);

    if (now_s >= t0 && now_s < t1) {
      // Compared at the same instant: the set-point of the step's end.
      const V3 e = quad.p - trajectory.at(now_s + 1e-3).p_W_m;
      f.mean_error_m += e.norm();
      f.mean_error_z_m += std::fabs(e.z());
      f.max_error_m = std::fmax(f.max_error_m, e.norm());
      for (std::size_t i = 0; i < 4; ++i) f.speed_ripple_rad_s += 0.25 * std::pow(command.omega_rad_s[i] - last_command[i], 2);
      const V3 nose = quad.q * V3::UnitX();
      const double yaw_error = std::remainder(std::atan2(nose.y(), nose.x()) - setpoint.yaw_rad, 2.0 * std::numbers::pi);
      f.yaw_rms_rad += yaw_error * yaw_error;
      f.yaw_max_rad = std::fmax(f.yaw_max_rad, std::fabs(yaw_error));
      f.iterations += command.diagnostics.mixer_iterations;
      ++counted;
    }
    if (now_s >= t0 && now_s < t1) {
      // `estimated` belongs to the step's start; carry it to the end with its own velocity and rate.
      const V3 p_then = estimated.p_W_m + estimated.v_W_m_s * 1e-3;
      f.est_p_rms_m += (p_then - quad.p).squaredNorm();
      f.est_p_excess_rms_m += (p_then - quad.p - drift).squaredNorm();
      f.drift_rms_m += drift.squaredNorm();
      f.est_v_rms_m_s += (estimated.v_W_m_s - quad.v + (quad.q * quad.specific_force - V3(0, 0, 9.80665)) * 1e-3).squaredNorm();
      const Q dq =
          estimated.q_WB.conjugate() * (quad.q * Q(1.0, -0.5e-3 * quad.w.x(), -0.5e-3 * quad.w.y(), -0.5e-3 * quad.w.z()).normalized());
      f.est_q_rms_rad += 4.0 * dq.vec().squaredNorm();
    }
    last_command = command.omega_rad_s;
    f.max_drag_N = std::fmax(f.max_drag_N, quad.drag_N);
    f.max_rate_rad_s = std::fmax(f.max_rate_rad_s, quad.w.norm());
    if (!(quad.p.norm() < 100.0)) {
      f.crashed = true;
      break;
    }
  }
  const double n = counted;
  f.mean_error_m /= n;
  f.mean_error_z_m /= n;
  f.speed_ripple_rad_s = std::sqrt(f.speed_ripple_rad_s / n);
  f.iterations /= n;
  f.yaw_rms_rad = std::sqrt(f.yaw_rms_rad / n);
  // rms per axis
  for (double* x : {&f.est_p_rms_m, &f.est_p_excess_rms_m, &f.drift_rms_m, &f.est_v_rms_m_s, &f.est_q_rms_rad})
    *x = std::sqrt(*x / (3.0 * n));
  f.controller = state.counters;
  f.estimator = estimator.counters();
  return f;
}

}  // namespace rotorloop::test
