// One loop over fine steps: command each millisecond, motors, noise, body, sensors.
#include "test/support/model_true_flight.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "host/base/elementary.hpp"
#include "host/base/random.hpp"
#include "test/support/string_load.hpp"

namespace rotorloop::model_true {
namespace {

// Standard normal vectors in the order they are asked for.
class Noise {
 public:
  Noise(std::uint64_t seed, std::uint64_t module) : stream_(seed, module) {}
  double next() { return stream_.gaussian(n_++); }
  Eigen::Vector3d vector() {
    const double x = next(), y = next(), z = next();
    return {x, y, z};
  }

 private:
  RandomStream stream_;
  std::uint64_t n_ = 0;
};

struct Kick {
  Eigen::Vector3d rate, integral;
};
Kick kick(double q, double h, Noise& noise) {
  const Eigen::Vector3d a = noise.vector(), b = noise.vector();
  Kick k;
  for (int i = 0; i < 3; ++i) {
    const NoiseIncrement n = white_increment(q, h, a[i], b[i]);
    k.rate[i] = n.rate;
    k.integral[i] = n.integral;
  }
  return k;
}

RotorSpeeds towards(const RotorSpeeds& now, const RotorSpeeds& goal, double share) {
  RotorSpeeds out{};
  for (std::size_t i = 0; i < 4; ++i) out[i] = goal[i] + share * (now[i] - goal[i]);
  return out;
}

// The pilot's filter: a pose that was taken when his estimate was `then` moves his estimate now, with the fixed gains of natural
// frequency (q/(σ√T))^½ and damping 0.71, at most 30 rad/s because of the interval that has passed.
void correct(const Truth& truth, const FlightSettings& s, const log::PoseReading& z, const State& then, State& now) {
  const double T = 1e-3 * s.pose_every_ms;
  const auto frequency = [&](double q, double sigma) {
    return std::clamp(std::sqrt(q / (std::max(sigma, 1e-5) * std::sqrt(T))), 5.0, 30.0);
  };
  const double wp = frequency(s.q_a_m_s2_rtHz, s.pose_sigma_m), wr = frequency(s.q_alpha_rad_s2_rtHz, s.pose_sigma_rad);
  const Eigen::Quaterniond q = (z.q_WS * truth.q_BS.conjugate()).normalized(), turn = then.q_WB.conjugate() * q;
  const Eigen::Vector3d p_error = z.p_W_m - q * truth.r_BS_m - then.p_W_m, r_error = (turn.w() < 0 ? -2.0 : 2.0) * turn.vec();
  now.p_W_m += 1.41 * wp * T * p_error;
  now.v_W_m_s += wp * wp * T * p_error;
  now.q_WB = (now.q_WB * exponential(1.41 * wr * T * r_error)).normalized();
  now.omega_B_rad_s += wr * wr * T * r_error;
}

}  // namespace

NoiseIncrement white_increment(double q, double h, double a, double b) {
  const double rate = q * std::sqrt(h) * a;
  return {rate, h / 2 * rate + q * std::sqrt(h * h * h / 12.0) * b};
}

ModelTrueFlight fly(const Truth& truth, const FlightSettings& s) {
  ModelTrueFlight out;
  out.truth = truth;
  log::FlightRecord& log = out.record;
  log.name = name_of(s.manoeuvre);
  log.source = "model-true, seed " + std::to_string(s.seed);
  const std::uint64_t module = 0x6d74ull + 16 * static_cast<std::uint64_t>(s.manoeuvre);  // flights of one seed are unrelated
  Noise force(s.seed, module), moment(s.seed, module + 1), pose(s.seed, module + 2), imu(s.seed, module + 3);

  const double h = 1e-3 / s.steps_per_ms;
  const int last = static_cast<int>(std::lround(s.duration_s / h));
  const double half_lag = exp_exact(-h / 2 / s.motor_lag_s), full_lag = exp_exact(-h / s.motor_lag_s);

  State x, seen, then;       // true; as the pilot estimates it, now and at the last pose
  log::PoseReading awaited;  // the last pose, which reaches the pilot with the next one
  RotorSpeeds omega = hover_speeds(truth), goal = omega;
  StringLoad load{.mass_kg = s.load_kg, .length_m = s.load_length_m};
  load.hang_under(x, s.load_aside_m);
  Eigen::Vector3d specific_sum = Eigen::Vector3d::Zero();  // body frame, over the fine steps since the last IMU sample
  for (int step = 0; step <= last; ++step) {
    const double t = step * h;
    const bool whole_ms = step % s.steps_per_ms == 0;
    const int ms = step / s.steps_per_ms;
    if (whole_ms && ms % s.rotor_log_every_ms == 0) log.rotor_omega_rad_s.add(t + truth.rotor_delay_s, omega);
    if (whole_ms && ms % s.pose_every_ms == 0) {
      log::PoseReading z;
      z.p_W_m = x.p_W_m + x.q_WB * truth.r_BS_m + s.pose_sigma_m * pose.vector();
      z.q_WS = (x.q_WB * truth.q_BS * exponential(s.pose_sigma_rad * pose.vector())).normalized();
      log.pose.add(t + truth.pose_delay_s, z);
      out.states.push_back(x);
      if (step > 0) correct(truth, s, awaited, then, seen);
      awaited = z;
      then = seen;
    }
    if (s.imu_every_ms > 0 && whole_ms && step > 0 && ms % s.imu_every_ms == 0) {
      const int n = s.imu_every_ms * s.steps_per_ms;
      log.accel_B_m_s2.add(t - n * h / 2, specific_sum / n + s.accel_bias_m_s2 + s.accel_sigma_m_s2 * imu.vector());
      log.gyro_B_rad_s.add(t, x.omega_B_rad_s + s.gyro_bias_rad_s + s.gyro_sigma_rad_s * imu.vector());
      specific_sum.setZero();
    }
    if (whole_ms) {
      const State& estimate = s.pilot_sees_truth ? x : seen;
      goal = s.path ? command(truth, s.path, false, t, estimate, omega) : command(truth, s.manoeuvre, t, estimate, omega);
      seen = advance(truth, seen, omega, towards(omega, goal, exp_exact(-0.5e-3 / s.motor_lag_s)), 1e-3);
    }

    State y = advance(truth, x, omega, towards(omega, goal, half_lag), h, &out.least_through_flow_m_s);
    const Kick a = kick(s.q_a_m_s2_rtHz, h, force), alpha = kick(s.q_alpha_rad_s2_rtHz, h, moment);
    y.v_W_m_s += a.rate;
    y.p_W_m += a.integral;
    y.q_WB = (y.q_WB * exponential(alpha.integral)).normalized();
    y.omega_B_rad_s += alpha.rate;
    if (s.load_kg > 0.0) y.v_W_m_s += h / truth.mass_kg * load.pull(x, h);
    const Eigen::Quaterniond q_middle = x.q_WB * exponential(h / 2 * x.omega_B_rad_s);
    specific_sum += q_middle.conjugate() * ((y.v_W_m_s - x.v_W_m_s) / h + Eigen::Vector3d(0, 0, kGravity_m_s2));
    omega = towards(omega, goal, full_lag);
    x = y;
  }
  return out;
}

std::vector<ModelTrueFlight> fly_identification_set(const Truth& truth, FlightSettings settings) {
  std::vector<ModelTrueFlight> out;
  for (const Manoeuvre m : {Manoeuvre::vertical, Manoeuvre::horizontal, Manoeuvre::rotation}) {
    settings.manoeuvre = m;
    out.push_back(fly(truth, settings));
  }
  return out;
}

}  // namespace rotorloop::model_true
