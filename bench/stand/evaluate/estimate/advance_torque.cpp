#include "bench/stand/evaluate/estimate/advance_torque.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/block_fit.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kSameAirspeed_m_s = 1.0;
constexpr double kLeastSpan = 0.05;  // of J
constexpr double kSameSpeed = 0.02;  // of a plan run twice

struct Points {
  Eigen::MatrixXd X;  // ω², ω² J²
  Eigen::VectorXd y, v_m_s, J;
  std::vector<int> block;
};

Points points_of(const StandRun& run) {
  const StandRecord& r = run.checked.record;
  std::vector<const StandPoint*> use;
  for (const StandPoint& p : r.points)
    if (p.airspeed_m_s == p.airspeed_m_s && p.torque_N_m == p.torque_N_m && p.omega_rad_s[0] > 0.0) use.push_back(&p);
  const auto n = static_cast<Eigen::Index>(use.size());
  Points out{Eigen::MatrixXd(n, 2), Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n), {}};
  for (Eigen::Index i = 0; i < n; ++i) {
    const StandPoint& p = *use[static_cast<std::size_t>(i)];
    const double w2 = p.omega_rad_s[0] * p.omega_rad_s[0];
    out.J(i) = p.airspeed_m_s / (p.omega_rad_s[0] / (2.0 * std::numbers::pi) * run.facts.diameter_m);
    out.X.row(i) << w2, w2 * out.J(i) * out.J(i);
    out.y(i) = p.torque_N_m;
    out.v_m_s(i) = p.airspeed_m_s;
    out.block.push_back(p.t_s == p.t_s ? static_cast<int>(p.t_s / 5.0) : static_cast<int>(i));
  }
  return out;
}

// Mean airspeeds of the groups that are apart.
std::vector<double> airspeeds(const Eigen::VectorXd& v) {
  std::vector<double> sorted(v.data(), v.data() + v.size()), out;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t first = 0; first < sorted.size();) {
    std::size_t last = first;
    double sum = 0.0;
    while (last < sorted.size() && sorted[last] - sorted[first] < kSameAirspeed_m_s) sum += sorted[last++];
    out.push_back(sum / static_cast<double>(last - first));
    first = last;
  }
  return out;
}

BlockFit fit_at(const Points& p, double v_m_s, Eigen::Index columns) {
  std::vector<Eigen::Index> use;
  for (Eigen::Index i = 0; i < p.y.size(); ++i)
    if (std::abs(p.v_m_s(i) - v_m_s) < kSameAirspeed_m_s) use.push_back(i);
  Eigen::MatrixXd X(static_cast<Eigen::Index>(use.size()), columns);
  Eigen::VectorXd y(X.rows());
  std::vector<int> block;
  for (Eigen::Index k = 0; k < X.rows(); ++k) {
    const Eigen::Index i = use[static_cast<std::size_t>(k)];
    X.row(k) = p.X.row(i).head(columns);
    y(k) = p.y(i);
    block.push_back(p.block[static_cast<std::size_t>(i)]);
  }
  return fit_in_blocks(X, y, block);
}

double rms_at(const Points& p, double v_m_s, const Eigen::VectorXd& c) {
  double sum = 0.0, n = 0.0;
  for (Eigen::Index i = 0; i < p.y.size(); ++i)
    if (std::abs(p.v_m_s(i) - v_m_s) < kSameAirspeed_m_s) {
      sum += std::pow(p.y(i) - p.X.row(i).head(c.size()).dot(c), 2);
      n += 1.0;
    }
  return std::sqrt(sum / n);
}

// Of like speed in still air, scaled to this one; not-a-number: none.
double still_torque_N_m(const StandRun& still, double omega_rad_s) {
  double sum = 0.0, n = 0.0;
  for (const StandStep& s : still.steps)
    if (s.torque_N_m == s.torque_N_m && s.omega_rad_s > 0.0 && std::abs(s.omega_rad_s / omega_rad_s - 1.0) < kSameSpeed) {
      sum += s.torque_N_m * std::pow(omega_rad_s / s.omega_rad_s, 2);
      n += 1.0;
    }
  return n > 0.0 ? sum / n : kNotMeasured;
}

}  // namespace

std::optional<AdvanceTorque> advance_torque(const StandRun& still, std::span<const StandRun> in_wind) {
  if (!(still.facts.diameter_m > 0.0)) return std::nullopt;
  std::vector<double> x, y;
  std::vector<int> block;
  AdvanceTorque out;
  for (const StandRun& run : in_wind)
    for (const StandStep& s : run.steps) {
      const double at_rest = s.omega_rad_s > 0.0 ? still_torque_N_m(still, s.omega_rad_s) : kNotMeasured;
      if (at_rest != at_rest || s.torque_N_m != s.torque_N_m || !(std::abs(s.airspeed_m_s) > 0.0)) continue;
      const double j_omega = 2.0 * std::numbers::pi * s.airspeed_m_s / still.facts.diameter_m, J = j_omega / s.omega_rad_s;
      x.push_back(j_omega * j_omega);
      y.push_back(s.torque_N_m - at_rest);
      block.push_back(static_cast<int>(block.size()) / 2);
      out.j_low = std::min(out.j_low, J);
      out.j_high = std::max(out.j_high, J);
    }
  if (x.size() < 6) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(x.size());
  const Eigen::MatrixXd X = Eigen::Map<const Eigen::VectorXd>(x.data(), n);
  const Eigen::VectorXd Y = Eigen::Map<const Eigen::VectorXd>(y.data(), n);
  const BlockFit f = fit_in_blocks(X, Y, block);
  out.c_q2_N_m_s2 = f.c(0);
  out.u2_N_m_s2 = f.u(0);
  out.rms_N_m = f.rms;
  out.constant_rms_N_m = std::sqrt(Y.squaredNorm() / static_cast<double>(n));
  return out;
}

std::optional<AdvanceTorque> advance_torque(const StandRun& run) {
  if (!(run.facts.diameter_m > 0.0) || run.checked.torque != StandChannelState::good) return std::nullopt;
  const Points p = points_of(run);
  if (p.y.size() < 12 || p.J.maxCoeff() - p.J.minCoeff() < kLeastSpan) return std::nullopt;
  const BlockFit all = fit_in_blocks(p.X, p.y, p.block), constant = fit_in_blocks(p.X.leftCols(1), p.y, p.block);
  AdvanceTorque out;
  out.c_q0_N_m_s2 = all.c(0);
  out.u0_N_m_s2 = all.u(0);
  out.c_q2_N_m_s2 = all.c(1);
  out.u2_N_m_s2 = all.u(1);
  out.correlation = all.covariance(0, 1) / std::sqrt(all.covariance(0, 0) * all.covariance(1, 1));
  out.j_low = p.J.minCoeff();
  out.j_high = p.J.maxCoeff();
  out.rms_N_m = all.rms;
  out.constant_rms_N_m = constant.rms;
  const auto speeds = airspeeds(p.v_m_s);
  for (const double from : speeds)
    for (const double to : speeds)
      if (from != to) out.trials.push_back({from, to, rms_at(p, to, fit_at(p, from, 2).c), rms_at(p, to, fit_at(p, from, 1).c)});
  return out;
}

}  // namespace rotorloop::stand
