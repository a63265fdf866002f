#include "bench/stand/instruments/load_calibration.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace rotorloop::modbus {
namespace {

// Loads of both axes and a constant must be distinguishable: the smallest singular value over the greatest, with loads as shares of full
// scale.
constexpr double kLeastSpread = 0.02;
constexpr double kGreatestCondition = 50.0;  // an error of the readings would come back fifty times larger

double condition_of(const Eigen::Matrix2d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix2d> svd(m);
  return svd.singularValues()(1) > 0.0 ? svd.singularValues()(0) / svd.singularValues()(1) : std::numeric_limits<double>::infinity();
}

}  // namespace

std::array<double, 2> LoadCalibration::load_of(const std::array<double, 2>& s) const {
  std::array<double, 2> out{};
  for (std::size_t i = 0; i < 2; ++i) out[i] = matrix[i][0] * (s[0] - zero[0]) + matrix[i][1] * (s[1] - zero[1]);
  return out;
}

LoadCalibration fit_calibration(const std::vector<LoadCase>& cases, const std::array<double, 2>& full_scale, std::string& problem) {
  LoadCalibration c;
  c.full_scale = full_scale;
  problem.clear();
  if (cases.size() < kLeastLoadCases) {
    problem = fmt::format("{} load cases, at least {} are needed", cases.size(), kLeastLoadCases);
    return c;
  }
  const auto n = static_cast<Eigen::Index>(cases.size());
  Eigen::MatrixXd design(n, 3), readings(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const LoadCase& k = cases[static_cast<std::size_t>(i)];
    design.row(i) << k.load[0] / full_scale[0], k.load[1] / full_scale[1], 1.0;
    readings.row(i) << k.reading[0], k.reading[1];
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(design, Eigen::ComputeThinU | Eigen::ComputeThinV);
  if (svd.singularValues()(2) < kLeastSpread * svd.singularValues()(0)) {
    problem = "the load cases do not separate thrust, torque and zero";
    return c;
  }
  const Eigen::MatrixXd x = svd.solve(readings);  // rows: sensitivity per full scale of each axis, zero
  const Eigen::Matrix2d a = x.topRows(2).transpose();
  Eigen::Matrix2d scaled = a;
  for (Eigen::Index i = 0; i < 2; ++i) {
    if (std::abs(a(i, i)) < 1e-12) {
      problem = fmt::format("the channel of axis {} does not follow its own load", i == 0 ? "thrust" : "torque");
      return c;
    }
    scaled.row(i) /= std::abs(a(i, i));
    c.cross_talk_percent[static_cast<std::size_t>(i)] = 100.0 * a(i, 1 - i) / a(i, i);
  }
  c.condition = condition_of(scaled);
  if (!(c.condition < kGreatestCondition)) {
    problem = fmt::format("the two channels show nearly the same: condition {:.0f}, at most {:.0f}", c.condition, kGreatestCondition);
    return c;
  }
  const Eigen::Matrix2d inverse = a.inverse();
  for (std::size_t i = 0; i < 2; ++i) {
    c.zero[i] = x(2, static_cast<Eigen::Index>(i));
    for (std::size_t k = 0; k < 2; ++k)
      c.matrix[i][k] = inverse(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) * full_scale[i];
  }
  std::array<double, 2> squares{};
  for (const LoadCase& k : cases) {
    const auto found = c.load_of(k.reading);
    for (std::size_t i = 0; i < 2; ++i) {
      const double left = found[i] - k.load[i];
      squares[i] += left * left;
      c.residual_max[i] = std::max(c.residual_max[i], std::abs(left));
    }
  }
  for (std::size_t i = 0; i < 2; ++i)
    c.residual_sd[i] = std::sqrt(squares[i] / static_cast<double>(cases.size() - 3));  // three parameters a channel
  c.cross_talk_u_m = c.residual_sd[1] * std::sqrt((design.transpose() * design).inverse()(0, 0)) / full_scale[0];
  return c;
}

}  // namespace rotorloop::modbus
