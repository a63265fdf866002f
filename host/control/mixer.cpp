#include "host/control/mixer.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "host/effects/advance.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::host {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Interval {
  double low = -kInfinity, high = kInfinity;
  bool empty() const { return low > high; }
  double clamp(double x) const { return std::min(std::max(x, low), high); }
  // Intersects with { x : slope x + constant <= 0 }.
  void cut(double slope, double constant) {
    if (slope > 0.0) {
      high = std::min(high, -constant / slope);
    } else if (slope < 0.0) {
      low = std::max(low, -constant / slope);
    } else if (constant > 0.0) {
      high = -kInfinity;
    }
  }
};

// Total thrusts T that the rotors can give together with a share k of the roll and pitch torque, whatever the yaw: each rotor
// bounds the free coordinate s from below and from above by lines in T and k, and every lower bound must stay below every
// upper one.
class ThrustRange {
 public:
  using Vector4 = Eigen::Matrix<double, kRotors, 1>;
  ThrustRange(const Vector4& free_direction, const Vector4& per_thrust, const Vector4& from_torque, const Vector4& low_N,
              const Vector4& high_N) {
    for (int i = 0; i < kRotors; ++i) {
      const double n = 1.0 / free_direction[i];
      const Line at_low{low_N[i] * n, -from_torque[i] * n, -per_thrust[i] * n}, at_high{high_N[i] * n, at_low.per_k, at_low.per_T};
      const auto at = static_cast<std::size_t>(i);
      lower_[at] = n > 0.0 ? at_low : at_high;
      upper_[at] = n > 0.0 ? at_high : at_low;
    }
    for (std::size_t i = 0; i < kRotors; ++i)
      for (std::size_t j = 0; j < kRotors; ++j) {
        const double slope = lower_[i].per_T - upper_[j].per_T;
        // Rounding leaves nothing of the slope between rotors that share a sign.
        inverse_[i][j] = std::fabs(slope) > 1e-9 * std::fabs(lower_[i].per_T) ? 1.0 / slope : 0.0;
      }
  }
  Interval at(double k) const {
    Interval thrust;
    for (std::size_t i = 0; i < kRotors; ++i)
      for (std::size_t j = 0; j < kRotors; ++j) {
        const double constant = lower_[i].constant - upper_[j].constant + k * (lower_[i].per_k - upper_[j].per_k);
        const double inverse = inverse_[i][j];
        if (inverse > 0.0) {
          thrust.high = std::min(thrust.high, -constant * inverse);
        } else if (inverse < 0.0) {
          thrust.low = std::max(thrust.low, -constant * inverse);
        } else if (constant > 0.0) {
          thrust.high = -kInfinity;
        }
      }
    return thrust;
  }

 private:
  struct Line {
    double constant = 0.0, per_k = 0.0, per_T = 0.0;
  };
  std::array<Line, kRotors> lower_, upper_;
  std::array<std::array<double, kRotors>, kRotors> inverse_{};
};

}  // namespace

// What each rotor can give around the present iterate.
struct Mixer::Bounds {
  Vector4 low_N, high_N;
};

Mixer::Mixer(const VehicleModel& vehicle, const MixerConfig& config)
    : config_(config),
      table_(vehicle.thrust, config.lookup),
      c_q_N_m_s2_(vehicle.c_q_N_m_s2),
      radius_m_(vehicle.thrust.radius_m),
      advance_(vehicle.advance),
      hover_omega_rad_s_(rotorloop::host::hover_omega_rad_s(vehicle)) {
  Eigen::Matrix<double, 3, kRotors> wrench;  // rows: total thrust, τx, τy per rotor thrust (eq. 3)
  for (int i = 0; i < kRotors; ++i) {
    const Eigen::Vector3d arm = vehicle.arm_m(i);
    arm_m_[static_cast<std::size_t>(i)] = arm;
    wrench.col(i) << 1.0, arm.y(), -arm.x();
    reaction_[i] = vehicle.rotors[static_cast<std::size_t>(i)].reaction;
  }
  from_wrench_ = wrench.transpose() * (wrench * wrench.transpose()).eval().inverse();
  // The null direction of a 3×4 matrix: its signed minors.
  for (int i = 0; i < kRotors; ++i) {
    Eigen::Matrix3d minor;
    for (int column = 0, j = 0; j < kRotors; ++j)
      if (j != i) minor.col(column++) = wrench.col(j);
    free_direction_[i] = (i % 2 ? -1.0 : 1.0) * minor.determinant();
  }
  free_direction_ /= free_direction_.norm();
}

// Fills thrust_N with the demand as far as the bounds allow and notes which part gave way. Thrusts are
// from_wrench (T, τx, τy) + free_direction s, and s alone makes yaw torque at given T, τx, τy.
bool Mixer::shape(const Bounds& bounds, double yaw_base_N_m, const Vector4& yaw_per_N, MixerDemand& demand, Vector4& thrust_N,
                  MixerResult& flags) const {
  const Vector4 per_thrust = from_wrench_.col(0);
  const Vector4 from_torque = from_wrench_.col(1) * demand.torque_B_N_m.x() + from_wrench_.col(2) * demand.torque_B_N_m.y();
  const auto range_of_s = [&](const Vector4& base) {
    Interval s;
    for (int i = 0; i < kRotors; ++i) {
      s.cut(free_direction_[i], base[i] - bounds.high_N[i]);
      s.cut(-free_direction_[i], bounds.low_N[i] - base[i]);
    }
    return s;
  };
  double keep = 1.0;
  Interval s = range_of_s(from_torque + per_thrust * demand.thrust_N);
  if (s.empty()) {
    const ThrustRange range(free_direction_, per_thrust, from_torque, bounds.low_N, bounds.high_N);
    Interval thrust = range.at(1.0);
    if (thrust.empty()) {
      flags.torque_limited = true;
      double low = 0.0, high = 1.0;
      for (int i = 0; i < 12; ++i) {
        const double middle = 0.5 * (low + high);
        (range.at(middle).empty() ? high : low) = middle;
      }
      keep = low;
      thrust = range.at(keep);
    }
    flags.thrust_limited = true;
    demand.thrust_N = thrust.clamp(demand.thrust_N);
    s = range_of_s(from_torque * keep + per_thrust * demand.thrust_N);
    if (s.empty()) s.low = s.high = 0.5 * (s.low + s.high);  // rounding at a corner
  }
  const Vector4 base = from_torque * keep + per_thrust * demand.thrust_N;
  const double authority = yaw_per_N.dot(free_direction_);
  const double wanted = authority != 0.0 ? (demand.torque_B_N_m.z() - yaw_base_N_m - yaw_per_N.dot(base)) / authority : 0.0;
  const double given = s.clamp(wanted);
  flags.yaw_limited = std::fabs(given - wanted) > 1e-9;
  thrust_N = base + free_direction_ * given;
  return !flags.yaw_limited && !flags.thrust_limited && !flags.torque_limited;
}

Eigen::Vector3d Mixer::hub_velocity_m_s(int rotor, const Eigen::Vector3d& v_B_m_s, const Eigen::Vector3d& w_B_rad_s) const {
  if (!config_.local_velocity) return v_B_m_s;
  return v_B_m_s + w_B_rad_s.cross(arm_m_[static_cast<std::size_t>(rotor)]);
}

MixerWrench Mixer::wrench(const std::array<double, kRotors>& omega_rad_s, const Eigen::Vector3d& v_B_m_s,
                          const Eigen::Vector3d& w_B_rad_s) const {
  MixerWrench out;
  for (int i = 0; i < kRotors; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Vector3d v = hub_velocity_m_s(i, v_B_m_s, w_B_rad_s);
    const double w = omega_rad_s[at] * omega_rad_s[at];
    const double thrust = table_.at(omega_rad_s[at], v.z(), std::sqrt(v.x() * v.x() + v.y() * v.y())).c_t_N_s2 * w;
    out.thrust_N += thrust;
    out.torque_B_N_m += Eigen::Vector3d(arm_m_[at].y() * thrust, -arm_m_[at].x() * thrust, reaction_[i] * c_q_N_m_s2_ * w);
    if (advance_.c_q2_N_m_s2 != 0.0) out.torque_B_N_m.z() += reaction_[i] * advance_torque_N_m(advance_, radius_m_, omega_rad_s[at], v.z());
  }
  return out;
}

MixerResult Mixer::solve(const MixerDemand& wanted, const std::array<double, kRotors>& guess_rad_s) const {
  const double w_min = config_.omega_min_rad_s * config_.omega_min_rad_s, w_max = config_.omega_max_rad_s * config_.omega_max_rad_s;
  Vector4 v_z, v_xy, w;  // w: ω²
  for (int i = 0; i < kRotors; ++i) {
    const Eigen::Vector3d v = hub_velocity_m_s(i, wanted.v_B_m_s, wanted.w_B_rad_s);
    v_z[i] = v.z();
    v_xy[i] = std::sqrt(v.x() * v.x() + v.y() * v.y());
    const double guess = guess_rad_s[static_cast<std::size_t>(i)];
    w[i] = std::clamp(guess * guess, w_min, w_max);
  }
  MixerResult out;
  for (int i = 0; i < kRotors; ++i) out.omega_rad_s[static_cast<std::size_t>(i)] = std::sqrt(w[i]);
  while (out.iterations < kMaxIterations) {
    ++out.iterations;
    // Thrust as a line in ω² about the iterate: T = T_k + g (w - w_k).
    Vector4 thrust_k, g;
    Bounds bounds;
    MixerResult flags;
    for (int i = 0; i < kRotors; ++i) {
      const ThrustTable::Value c = table_.at(out.omega_rad_s[static_cast<std::size_t>(i)], v_z[i], v_xy[i]);
      thrust_k[i] = c.c_t_N_s2 * w[i];
      g[i] = c.slope_N_s2;
      bounds.low_N[i] = thrust_k[i] + g[i] * (w_min - w[i]);
      bounds.high_N[i] = thrust_k[i] + g[i] * (w_max - w[i]);
      flags.table_edge |= c.at_edge;
    }
    // Yaw row of eq. (3) in thrusts: Σ r c_q (w_k + (T - T_k)/g).
    const Vector4 yaw_per_N = c_q_N_m_s2_ * reaction_.cwiseQuotient(g);
    double yaw_base_N_m = c_q_N_m_s2_ * reaction_.dot(w) - yaw_per_N.dot(thrust_k);
    // Within its range what J adds does not depend on the speed; outside it the iteration follows it.
    for (int i = 0; advance_.c_q2_N_m_s2 != 0.0 && i < kRotors; ++i)
      yaw_base_N_m += reaction_[i] * advance_torque_N_m(advance_, radius_m_, out.omega_rad_s[static_cast<std::size_t>(i)], v_z[i]);
    MixerDemand demand = wanted;
    Vector4 thrust;
    shape(bounds, yaw_base_N_m, yaw_per_N, demand, thrust, flags);
    out.yaw_limited = flags.yaw_limited;
    out.thrust_limited = flags.thrust_limited;
    out.torque_limited = flags.torque_limited;
    out.table_edge = flags.table_edge;
    out.residual_rad_s = 0.0;
    for (int i = 0; i < kRotors; ++i) {
      const double next = std::clamp(w[i] + (thrust[i] - thrust_k[i]) / g[i], w_min, w_max);
      const double omega = std::sqrt(next);
      double& last = out.omega_rad_s[static_cast<std::size_t>(i)];
      out.residual_rad_s = std::max(out.residual_rad_s, std::fabs(omega - last));
      last = omega;
      w[i] = next;
    }
    if (out.residual_rad_s <= kConverged_rad_s) break;
  }
  return out;
}

}  // namespace rotorloop::host
