// State at 1 kHz from IMU samples and delayed poses: an error-state Kalman filter that lives at the measurement time of the last
// pose (the horizon). A pose moves the horizon: the filter rolls forward through the kept IMU samples to the pose's stamp,
// fuses it there, and the nominal state is carried from the stamp to now through the rest. Between poses each IMU sample adds
// one cheap step. Fixed-size buffers, no heap, no clock: time is what the samples say.
// State: position, velocity, attitude, gyro bias, accelerometer bias (15 error states, attitude error in body axes).
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>

#include "host/estimate/samples.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::host {

struct EstimatorConfig {
  // Noise densities of the IMU, vibration included (white part; per-sample σ over the square root of the rate).
  double gyro_noise_rad_s_rtHz = 5e-4;
  double accel_noise_m_s2_rtHz = 1e-2;
  double gyro_bias_walk_rad_s2_rtHz = 1e-4;
  double accel_bias_walk_m_s3_rtHz = 1e-3;
  // Pose sensor, per message and axis.
  double position_noise_m = 0.003;
  double attitude_noise_rad = 0.003;
  double velocity_noise_m_s = 0.05;
  // Biases at switch-on (standard deviation).
  double gyro_bias_start_rad_s = 0.02;
  double accel_bias_start_m_s2 = 0.2;
  // What is left between a pose's stamp and the instant it shows, seconds; positive: the stamp is late. Nominal 0.
  double pose_stamp_offset_s = 0.0;
  // false: every pose is taken as if measured when it arrived. Only to show what latency costs.
  bool compensate_latency = true;
  // A pose whose normalised innovation (each of position, velocity, attitude, 3 degrees of freedom) exceeds this is refused …
  double gate_sigma = 6.0;
  // … unless refusals have lasted this long: then the sensor is accepted and the state jumps (relocalisation).
  double gate_patience_s = 0.15;
  // Poses averaged for initialisation; the vehicle shall be at rest.
  int start_poses = 10;
  // Valid as long as the last fused pose is at most this old.
  double coast_max_s = 0.25;
};

struct EstimatorCounters {
  std::uint64_t imu = 0;
  std::uint64_t imu_rejected = 0;  // not finite, or time not increasing
  std::uint64_t imu_gaps = 0;      // more than kMaxImuStep_us between samples; bridged with the samples at both ends
  std::uint64_t poses = 0;         // that arrived
  std::uint64_t poses_fused = 0;
  std::uint64_t poses_not_finite = 0;
  std::uint64_t poses_out_of_order = 0;  // stamp at or before the horizon
  std::uint64_t poses_too_old = 0;       // stamp before the oldest kept IMU sample
  std::uint64_t poses_from_future = 0;   // stamp later than the newest IMU sample by more than kFutureWait_us
  std::uint64_t poses_dropped = 0;       // waiting queue full
  std::uint64_t poses_gated = 0;         // outliers
  std::uint64_t resets = 0;              // persistent jumps that were accepted
};

class Estimator {
 public:
  static constexpr std::size_t kImuBuffer = 256;  // 256 ms at 1 kHz: the most latency that can be undone
  static constexpr std::size_t kPoseQueue = 8;    // poses waiting for the IMU samples around their stamp
  static constexpr std::int64_t kMaxImuStep_us = 20'000;
  static constexpr std::int64_t kFutureWait_us = 20'000;

  Estimator(const EstimatorConfig& config, const VehicleModel& vehicle);

  // One IMU sample: fuses the poses that wait for it, carries the state to its time. Poses that arrived before this sample are
  // to be handed over before it.
  const StateEstimate& on_imu(const ImuSample& sample);
  // A pose as it arrives. It is fused with the next IMU sample at or after its stamp.
  void on_pose(const PoseSample& pose);

  const StateEstimate& estimate() const { return estimate_; }
  const EstimatorCounters& counters() const { return counters_; }
  Eigen::Vector3d gyro_bias_rad_s() const { return now_.gyro_bias; }
  Eigen::Vector3d accel_bias_m_s2() const { return now_.accel_bias; }
  // Standard deviations at the horizon, in the order of the state.
  Eigen::Matrix<double, 15, 1> sigma() const;

 private:
  using Covariance = Eigen::Matrix<double, 15, 15>;
  struct Nominal {
    std::int64_t time_us = 0;
    Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  };
  struct Start {  // sums over the first poses and the IMU samples beside them
    int poses = 0;
    Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
    Eigen::Vector4d q = Eigen::Vector4d::Zero();
  };

  const ImuSample& imu(std::size_t age) const;   // 0: newest
  ImuSample imu_at(std::int64_t time_us) const;  // interpolated
  static void carry(Nominal& s, const ImuSample& from, const ImuSample& to);
  void roll_to(std::int64_t time_us);  // horizon and covariance
  void refresh_now();                  // nominal state from the horizon to the newest sample
  void take(const PoseSample& pose, std::int64_t stamp_us);
  void initialise(const PoseSample& pose, std::int64_t stamp_us);
  bool fuse(const PoseSample& pose);
  void correct(const Eigen::Matrix<double, 15, 1>& dx);
  void publish(const ImuSample& sample);

  EstimatorConfig config_;
  Eigen::Vector3d p_BS_m_;
  Eigen::Quaterniond q_BS_;

  std::array<ImuSample, kImuBuffer> imu_{};
  std::size_t imu_count_ = 0, imu_newest_ = 0;
  std::array<PoseSample, kPoseQueue> queue_{};
  std::size_t queued_ = 0;

  bool started_ = false;
  Start start_;
  Nominal horizon_, now_;
  Covariance P_ = Covariance::Zero();
  std::int64_t last_fused_us_ = 0;
  std::int64_t refusing_since_us_ = -1;  // stamp of the first refused pose of a row; -1: none
  StateEstimate estimate_;
  EstimatorCounters counters_;
};

}  // namespace rotorloop::host
