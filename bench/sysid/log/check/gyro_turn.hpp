// The integral of a gyro beside the attitudes of a pose stream. Private to the checks.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::log {

// What has to be known of a gyro before its integral can be compared with attitudes: rate of the pose sensor = turn * gyro + bias; a pose
// stamped t shows the attitude of t - late_s.
struct GyroFit {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Eigen::Vector3d bias_rad_s = Eigen::Vector3d::Zero();
  double late_s = 0.0;
};

// A stretch of the gyro without a gap, and the poses within it: indices of the first and behind the last.
struct GyroStretch {
  std::size_t gyro_first = 0, gyro_end = 0, first = 0, end = 0;
};
std::vector<GyroStretch> gyro_stretches(const FlightRecord& r, double late_s);

// Robust against poses that are wrong now and then. None where gyro and pose do not show one motion, or too little of it.
std::optional<GyroFit> fitted_gyro(const FlightRecord& r);

// Attitude of the pose sensor by the gyro alone, from an arbitrary one at the beginning; between samples the rate is linear.
class GyroTurn {
 public:
  GyroTurn(const Stream<Eigen::Vector3d>& gyro_B_rad_s, const GyroStretch& stretch, const GyroFit& fit);
  bool covers(double t_s) const { return t_s_.size() > 1 && t_s >= t_s_.front() && t_s <= t_s_.back(); }
  Eigen::Quaterniond attitude(double t_s) const;  // `t_s` covered, on the gyro's clock
  Eigen::Vector3d rate_rad_s(double t_s) const;

 private:
  std::size_t before(double t_s) const;
  std::vector<double> t_s_;
  std::vector<Eigen::Vector3d> rate_rad_s_;
  std::vector<Eigen::Quaterniond> attitude_;
};

}  // namespace rotorloop::log
