#include "bench/sysid/estimate/noise_limits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bench/sysid/estimate/model/rotations.hpp"

namespace rotorloop::estimate {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr std::array kFigures{&NoiseModel::force_m_s2_rtHz, &NoiseModel::angular_rad_s2_rtHz, &NoiseModel::position_m,
                              &NoiseModel::attitude_rad,    &NoiseModel::velocity_m_s,        &NoiseModel::gyro_rad_s,
                              &NoiseModel::accel_m_s2};
// Above the scatter: noise that is not quite white, and the chance of some hundred samples.
constexpr double kAbove = 1.5;
// No limit below what good sensors leave: readings out of a filter scatter by next to nothing and are no better for it.
constexpr double kGoodPosition_m = 1e-3, kGoodAttitude_rad = 3e-3, kGoodVelocity_m_s = 0.05, kGoodGyro_rad_s = 0.02, kGoodAccel_m_s2 = 0.3;
constexpr std::size_t kFewest = 50;       // triples of readings
constexpr double kLongestInterval = 2.5;  // of the usual one: across a gap the motion bends

double usual_interval_s(const std::vector<double>& t_s) {
  std::vector<double> d;
  for (std::size_t i = 1; i < t_s.size(); ++i) d.push_back(t_s[i] - t_s[i - 1]);
  std::nth_element(d.begin(), d.begin() + static_cast<std::ptrdiff_t>(d.size() / 2), d.end());
  return d[d.size() / 2];
}

// Mean squares of what each reading lies off the line between its neighbours, over what white noise of variance 1 would leave of three.
// off(i, share): of reading i, with `share` of the way from the one before to the one behind. Infinite where there are too few.
template <class Fix, class Off>
Eigen::Vector3d scatter(const GridFlight& g, const std::vector<Fix>& list, const Off& off) {
  std::vector<double> t_s;
  for (const Fix& f : list) t_s.push_back(g.time_s(f.node) + f.late_s);
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  std::size_t count = 0;
  const double longest_s = t_s.size() < kFewest ? 0.0 : kLongestInterval * usual_interval_s(t_s);
  for (std::size_t i = 1; i + 1 < t_s.size(); ++i) {
    const double before_s = t_s[i] - t_s[i - 1], after_s = t_s[i + 1] - t_s[i];
    if (!(before_s > 0.0 && after_s > 0.0) || before_s > longest_s || after_s > longest_s) continue;
    const double w = before_s / (before_s + after_s);
    squares += off(i, w).cwiseAbs2() / (1.0 + (1.0 - w) * (1.0 - w) + w * w);
    ++count;
  }
  if (count < kFewest) return Eigen::Vector3d::Constant(kNone);
  return (squares / static_cast<double>(count)).cwiseSqrt();
}

Eigen::Vector3d limit(const GridFlight& g, const std::vector<VectorFix>& list, double good) {
  const auto off = [&](std::size_t i, double w) -> Eigen::Vector3d {
    return list[i].value - (1.0 - w) * list[i - 1].value - w * list[i + 1].value;
  };
  return (kAbove * scatter(g, list, off)).cwiseMax(good);
}

}  // namespace

NoiseModel noise_limits(const GridFlight& g) {
  const auto place = [&](std::size_t i, double w) -> Eigen::Vector3d {
    return g.pose[i].value.p_W_m - (1.0 - w) * g.pose[i - 1].value.p_W_m - w * g.pose[i + 1].value.p_W_m;
  };
  const auto turn = [&](std::size_t i, double w) {
    const Eigen::Quaterniond &a = g.pose[i - 1].value.q_WS, &b = g.pose[i].value.q_WS, &c = g.pose[i + 1].value.q_WS;
    return log_q((a * exp_q(w * log_q(a.conjugate() * c))).conjugate() * b);
  };
  NoiseModel out;
  for (const auto figure : kFigures) (out.*figure).setConstant(kNone);
  out.position_m = g.pose.empty() ? limit(g, g.position, kGoodPosition_m)
                                  : Eigen::Vector3d((kAbove * scatter(g, g.pose, place)).cwiseMax(kGoodPosition_m));
  out.attitude_rad = (kAbove * scatter(g, g.pose, turn)).cwiseMax(kGoodAttitude_rad);
  out.velocity_m_s = limit(g, g.velocity, kGoodVelocity_m_s);
  out.gyro_rad_s = limit(g, g.gyro, kGoodGyro_rad_s);
  out.accel_m_s2 = limit(g, g.accel, kGoodAccel_m_s2);
  return out;
}

NoiseModel pooled_limits(const std::vector<NoiseModel>& flights) {
  NoiseModel out;
  for (const auto figure : kFigures) {
    Eigen::Vector3d squares = Eigen::Vector3d::Zero();
    for (const NoiseModel& n : flights) squares += (n.*figure).cwiseAbs2();
    out.*figure = (squares / static_cast<double>(flights.size())).cwiseSqrt();
  }
  return out;
}

NoiseModel within(const NoiseModel& noise, const NoiseModel& limits) {
  NoiseModel out = noise;
  for (const auto figure : kFigures) out.*figure = (noise.*figure).cwiseMin(limits.*figure);
  return out;
}

}  // namespace rotorloop::estimate
