// Moments of the speeds and turning of the vehicle; see check_moments.hpp.
#include "bench/sysid/log/check/check_moments.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/constants.hpp"
#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::log {

std::array<double, 3> moment_signs(const host::VehicleModel& vehicle, std::size_t rotor) {
  const Eigen::Vector3d arm = vehicle.arm_m(static_cast<int>(rotor));
  return {std::copysign(1.0, arm.y()), std::copysign(1.0, arm.x()), static_cast<double>(vehicle.rotors[rotor].reaction)};
}

std::vector<MomentSample> moment_samples(const FlightGrid& g, const std::vector<char>& in_flight, const host::VehicleModel& vehicle) {
  std::vector<MomentSample> out;
  if (!g.has_rotors || (!g.has_gyro && !g.has_attitude)) return out;
  double arm_x = 0.0, arm_y = 0.0;
  for (int k = 0; k < 4; ++k) {
    arm_x += 0.25 * std::abs(vehicle.arm_m(k).x());
    arm_y += 0.25 * std::abs(vehicle.arm_m(k).y());
  }
  if (!(arm_x > 0.0) || !(arm_y > 0.0)) return out;
  const auto& rate = g.has_gyro ? g.gyro_B_rad_s : g.pose_rate_B_rad_s;
  const auto valid = [&](std::size_t i) { return g.valid[i] && in_flight[i]; };
  const auto sum_of_squares = [](const RotorValues& w) { return w[0] * w[0] + w[1] * w[1] + w[2] * w[2] + w[3] * w[3]; };
  std::vector<double> sums;
  for (std::size_t i = 0; i < g.grid.count; i += kMomentStride)
    if (valid(i)) sums.push_back(sum_of_squares(g.omega_rad_s[i]));
  const double usual = median(std::move(sums));
  if (!(usual > 0.0)) return out;
  const double usual_rad_s = std::sqrt(0.25 * usual);
  const double span_s = 2.0 * g.grid.dt_s * static_cast<double>(kMomentStride);
  for (std::size_t i = kMomentStride; i + kMomentStride < g.grid.count; i += kMomentStride) {
    const std::size_t a = i - kMomentStride, b = i + kMomentStride;
    MomentSample m{.t_s = g.grid.t_s(i),
                   .valid = valid(i) && valid(a) && valid(b),
                   .square = {},
                   .rate_B_rad_s = rate[i],
                   .acceleration_B_rad_s2 = (rate[b] - rate[a]) / span_s,
                   .velocity_B_m_s = Eigen::Vector3d::Zero(),
                   .moment = {}};
    if (g.has_attitude) m.velocity_B_m_s = g.q_WB[i].conjugate() * (g.has_velocity ? g.velocity_W_m_s[i] : g.position_rate_W_m_s[i]);
    if (g.has_accel)
      m.thrust_g = g.accel_B_m_s2[i].z() / kGravity_m_s2;
    else if (g.has_attitude)
      m.thrust_g = (g.q_WB[i].conjugate() * (g.position_acc_W_m_s2[i] / kGravity_m_s2 + Eigen::Vector3d::UnitZ())).z();
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector3d arm = vehicle.arm_m(static_cast<int>(k));
      const double reaction = vehicle.rotors[k].reaction;
      m.square[k] = g.omega_rad_s[i][k] * g.omega_rad_s[i][k] / usual;
      m.moment[0] += m.square[k] * arm.y() / arm_y;
      m.moment[1] += m.square[k] * arm.x() / arm_x;
      m.moment[2] += m.square[k] * reaction;
      m.spin_s += reaction * (g.omega_rad_s[b][k] - g.omega_rad_s[a][k]) / (span_s * usual_rad_s);
    }
    out.push_back(m);
  }
  return out;
}

Unexplained unexplained_moments(const std::vector<MomentSample>& samples, const std::function<bool(std::size_t)>& sound) {
  constexpr int kRegressors = 11;
  Unexplained out{.imbalance = std::vector<Imbalance>(samples.size()), .constant = {}};
  using Row = Eigen::Matrix<double, kRegressors, 1>;
  double count = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const int j = (axis + 1) % 3, l = (axis + 2) % 3;
    const auto row = [&](const MomentSample& m) {
      Row r;
      r << 1.0, m.thrust_g - 1.0, m.acceleration_B_rad_s2[axis], m.rate_B_rad_s[j] * m.rate_B_rad_s[l], m.rate_B_rad_s, m.velocity_B_m_s,
          axis == 2 ? m.spin_s : 0.0;
      return r;
    };
    Eigen::Matrix<double, kRegressors, kRegressors> normal = Eigen::Matrix<double, kRegressors, kRegressors>::Zero();
    Row right = Row::Zero();
    const auto a = static_cast<std::size_t>(axis);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const MomentSample& m = samples[i];
      if (!m.valid || !sound(i)) continue;
      const Row r = row(m);
      normal += r * r.transpose();
      right += r * m.moment[a];
    }
    for (int k = 0; k < kRegressors; ++k) normal(k, k) += 1e-9 * normal(k, k) + 1e-12;
    const Row x = LdltFactor(normal).solve(Eigen::VectorXd(right));
    for (std::size_t i = 0; i < samples.size(); ++i) {
      out.imbalance[i][a] = samples[i].moment[a] - x.dot(row(samples[i]));
      if (samples[i].valid && sound(i)) {
        out.mean_square += out.imbalance[i][a] * out.imbalance[i][a];
        count += 1.0;
      }
    }
    out.constant[a] = x[0];
  }
  out.mean_square /= std::max(1.0, count);
  return out;
}

}  // namespace rotorloop::log
