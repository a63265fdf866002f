// Least-squares parabola through measurements about a moment: what they are there, without what a mean makes of curved motion.
#pragma once
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>

namespace rotorloop::estimate {

template <int N>
class LocalParabola {
 public:
  // `at`: distance from the moment, in a unit that keeps it near 1.
  void add(double at, const Eigen::Matrix<double, N, 1>& measurement) {
    double p = 1.0;
    for (std::size_t i = 0; i < power_.size(); ++i, p *= at) {
      power_[i] += p;
      if (i < value_.size()) value_[i] += p * measurement;
    }
  }
  double count() const { return power_[0]; }
  double mean_place() const { return power_[1] / power_[0]; }
  Eigen::Matrix<double, N, 1> mean() const { return value_[0] / power_[0]; }
  // Needs three measurements at different places.
  Eigen::Matrix<double, N, 1> at_moment() const {
    Eigen::Matrix<double, 3, N> values;
    for (std::size_t i = 0; i < 3; ++i) values.row(static_cast<Eigen::Index>(i)) = value_[i].transpose();
    return moments().ldlt().solve(values).row(0).transpose();
  }
  // … of at_moment(), where each measurement has a variance of 1.
  double variance_at_moment() const { return moments().ldlt().solve(Eigen::Vector3d::UnitX()).x(); }

 private:
  Eigen::Matrix3d moments() const {
    Eigen::Matrix3d out;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) out(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = power_[i + j];
    }
    return out;
  }
  using Value = Eigen::Matrix<double, N, 1>;
  std::array<double, 5> power_{};  // sums of the powers of the distance, alone and times the measurements
  std::array<Value, 3> value_{Value::Zero(), Value::Zero(), Value::Zero()};
};

}  // namespace rotorloop::estimate
