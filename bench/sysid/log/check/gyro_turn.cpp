#include "bench/sysid/log/check/gyro_turn.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "bench/sysid/log/check/stream_access.hpp"
#include "host/base/rotation_vector.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::log {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kTurnStep_s = 0.05;  // over which turns are compared: longer than the noise of attitudes, shorter than a manoeuvre
constexpr std::size_t kFewestPoses = 100, kFewestTurns = 50;
constexpr double kTukey = 5.0;           // deviations beyond which a turn has no weight
constexpr double kMedianOfThree = 1.54;  // median length of a vector of three normal numbers of deviation 1
constexpr int kGyroFitRounds = 12;
constexpr double kLatest_s = 0.1, kLeastGain = 0.7, kMostGain = 1.3;  // beyond: not one motion

// One round of weighted least squares: turns of the pose against those of the gyro.
struct FitRound {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();  // of a row of the turn and its bias, alike for the three axes
  Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
  double change = 0.0, late = 0.0;
  std::vector<double> errors_rad;

  void add(const FlightRecord& r, const GyroStretch& s, const GyroFit& fit, std::size_t step, double scale_rad) {
    const GyroTurn raw(r.gyro_B_rad_s, s, {});
    for (std::size_t i = s.first; i + step < s.end; i += std::max<std::size_t>(1, step / 2)) {
      const double from = r.pose.t_s[i] - fit.late_s, to = r.pose.t_s[i + step] - fit.late_s;
      if (!raw.covers(from) || !raw.covers(to) || to - from > 3.0 * kTurnStep_s) continue;
      const Vector3d seen = log_q(r.pose.value[i].q_WS.conjugate() * r.pose.value[i + step].q_WS);
      Eigen::Vector4d x;
      x << log_q(raw.attitude(from).conjugate() * raw.attitude(to)), to - from;
      const Vector3d error = seen - fit.turn * x.head<3>() - fit.bias_rad_s * x[3];
      const double u = error.norm() / (kTukey * scale_rad), w = u < 1.0 ? (1.0 - u * u) * (1.0 - u * u) : 0.0;
      errors_rad.push_back(error.norm());
      information += w * x * x.transpose();
      right += w * x * seen.transpose();
      const Vector3d rate_change = fit.turn * (raw.rate_rad_s(to) - raw.rate_rad_s(from));
      change += w * rate_change.squaredNorm();
      late -= w * rate_change.dot(error);
    }
  }
};

// An axis about which the vehicle hardly turned keeps what it had.
void take_turn_and_bias(GyroFit& fit, const FitRound& sum) {
  constexpr double kHold = 1e-3;
  Eigen::Matrix<double, 4, 3> before;
  before << fit.turn.transpose(), fit.bias_rad_s.transpose();
  const double hold = kHold * sum.information.trace() + 1e-12;
  const Eigen::Matrix4d information = sum.information + hold * Eigen::Matrix4d::Identity();
  const Eigen::Matrix<double, 4, 3> x = information.ldlt().solve(sum.right + hold * before);
  fit.turn = x.topRows<3>().transpose();
  fit.bias_rad_s = x.row(3).transpose();
}

}  // namespace

std::vector<GyroStretch> gyro_stretches(const FlightRecord& r, double late_s) {
  const auto& t = r.gyro_B_rad_s.t_s;
  const auto pose_from = [&](double at_s) {
    return static_cast<std::size_t>(std::lower_bound(r.pose.t_s.begin(), r.pose.t_s.end(), at_s) - r.pose.t_s.begin());
  };
  const double longest_s = std::max(5.0 * period_s(r.gyro_B_rad_s), 0.02);
  std::vector<GyroStretch> out;
  for (std::size_t from = 0, i = 1; i <= t.size(); ++i) {
    if (i < t.size() && t[i] - t[i - 1] <= longest_s) continue;
    const GyroStretch s{from, i, pose_from(t[from] + late_s), pose_from(t[i - 1] + late_s)};
    if (s.end > s.first + kFewestPoses) out.push_back(s);
    from = i;
  }
  return out;
}

std::optional<GyroFit> fitted_gyro(const FlightRecord& r) {
  GyroFit fit;
  if (r.pose.size() < kFewestPoses || r.gyro_B_rad_s.size() < kFewestPoses) return std::nullopt;
  const auto step = static_cast<std::size_t>(std::max(1.0, std::round(kTurnStep_s / period_s(r.pose))));
  double scale_rad = 1e9;  // at first all turns count alike
  for (int round = 0; round < kGyroFitRounds; ++round) {
    FitRound sum;
    for (const GyroStretch& s : gyro_stretches(r, fit.late_s)) sum.add(r, s, fit, step, scale_rad);
    if (sum.errors_rad.size() < kFewestTurns) return std::nullopt;
    take_turn_and_bias(fit, sum);
    if (round > 2 && sum.change > 0.0) fit.late_s += std::clamp(sum.late / sum.change, -0.01, 0.01);
    if (std::abs(fit.late_s) > kLatest_s) return std::nullopt;
    scale_rad = std::max(median(std::move(sum.errors_rad)) / kMedianOfThree, 1e-4);
  }
  const Vector3d gains = Eigen::JacobiSVD<Eigen::Matrix3d>(fit.turn).singularValues();
  return gains.maxCoeff() < kMostGain && gains.minCoeff() > kLeastGain ? std::optional(fit) : std::nullopt;
}

GyroTurn::GyroTurn(const Stream<Vector3d>& gyro, const GyroStretch& s, const GyroFit& fit)
    : t_s_(gyro.t_s.begin() + static_cast<std::ptrdiff_t>(s.gyro_first), gyro.t_s.begin() + static_cast<std::ptrdiff_t>(s.gyro_end)) {
  for (std::size_t i = s.gyro_first; i < s.gyro_end; ++i) rate_rad_s_.push_back(fit.turn * gyro.value[i] + fit.bias_rad_s);
  attitude_.push_back(Quaterniond::Identity());
  for (std::size_t i = 1; i < t_s_.size(); ++i) {
    const Vector3d turn = 0.5 * (rate_rad_s_[i - 1] + rate_rad_s_[i]) * (t_s_[i] - t_s_[i - 1]);
    attitude_.push_back((attitude_.back() * exp_q(turn)).normalized());
  }
}

std::size_t GyroTurn::before(double t_s) const {
  const auto i = static_cast<std::size_t>(std::upper_bound(t_s_.begin(), t_s_.end(), t_s) - t_s_.begin());
  return std::min(i - std::min<std::size_t>(i, 1), t_s_.size() - 2);
}

Quaterniond GyroTurn::attitude(double t_s) const {
  const std::size_t i = before(t_s);
  return attitude_[i] * exp_q(0.5 * (rate_rad_s_[i] + rate_rad_s(t_s)) * (t_s - t_s_[i]));
}

Vector3d GyroTurn::rate_rad_s(double t_s) const {
  const std::size_t i = before(t_s);
  return rate_rad_s_[i] + (t_s - t_s_[i]) / (t_s_[i + 1] - t_s_[i]) * (rate_rad_s_[i + 1] - rate_rad_s_[i]);
}

}  // namespace rotorloop::log
