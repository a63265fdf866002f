// The pose sensor: visual-inertial odometry as the controller sees it. Pose and velocity of the sensor's own point, measured
// at an instant of the airframe's clock, arriving later, with white noise and a slowly wandering position.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>

#include "host/base/random.hpp"
#include "sim/airframe/airframe.hpp"

namespace rotorloop::sim {

// Defaults are the reference sensors of the product; a run never softens them.
struct PoseConfig {
  std::int64_t rate_Hz = 200;
  double latency_s = 0.015;          // mean delay from measurement to arrival
  double jitter_s = 0.003;           // uniform, +- this; not above latency_s
  double noise_m = 0.002;            // white, standard deviation per axis of W
  double noise_rad = 0.002;          // white, standard deviation per axis of S
  double velocity_noise_m_s = 0.05;  // white, standard deviation per axis of W
  double drift_m = 0.005;            // first-order Gauss-Markov, stationary standard deviation per axis of W
  double drift_tau_s = 15.0;         // its correlation time
  bool drift_enabled = true;         // ablation: what does the drift cost?
  Eigen::Vector3d offset_B_m = Eigen::Vector3d(0.090, 0.006, 0.014);  // sensor point, from the centre of mass
  Eigen::Quaterniond q_BS = Eigen::Quaterniond::Identity();
  // Defects that nobody declared; effects set them.
  double stamp_error_s = 0.0;                          // added to the stamp of every reading; above 0 the reading is older than it says
  double stamp_rate_error = 0.0;                       // added to the stamp for each second of the clock
  double stamp_jitter_s = 0.0;                         // white error of the stamp, standard deviation
  double scale_error = 0.0;                            // of positions and velocities: 1 + this
  Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();  // of the sensor's world against W, about x and y; small
};

struct PoseReading {
  std::int64_t time_ns = 0;                         // of the measurement
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();  // of the sensor point
  Eigen::Quaterniond q_WS = Eigen::Quaterniond::Identity();
  Eigen::Vector3d v_W_m_s = Eigen::Vector3d::Zero();  // of the sensor point
};

struct PoseArrival {
  PoseReading reading;
  std::int64_t arrival_time_ns = 0;  // never before that of the sample before it
};

class PoseSensor {
 public:
  // Throws Error when a delay is negative, the jitter exceeds the latency, or more readings would be under way than kQueue.
  PoseSensor(const PoseConfig& config, std::uint64_t seed);

  std::int64_t time_of_sample_ns(std::int64_t n) const { return n * 1'000'000'000 / config_.rate_Hz; }
  // Measures sample n (0, 1, 2 … in order) now, at state.time_ns, and puts the reading under way.
  PoseArrival sample(std::int64_t n, const AirframeState& state);
  // The oldest reading that has arrived by now_ns, once; call until empty.
  std::optional<PoseReading> take(std::int64_t now_ns);
  // When the next reading arrives, if one is under way.
  std::optional<std::int64_t> next_arrival_ns() const;
  std::size_t under_way() const { return count_; }
  // Readings pushed out because nobody took them; zero in a loop that takes what has arrived.
  std::uint64_t lost() const { return lost_; }
  // Present wandering of the position, for logs of the truth.
  const Eigen::Vector3d& drift_W_m() const { return drift_W_m_; }

  static constexpr std::size_t kQueue = 64;

 private:
  void apply_defects(PoseReading& reading, std::uint64_t sample) const;

  PoseConfig config_;
  RandomStream noise_;
  RandomStream drift_;
  RandomStream delay_;
  RandomStream stamp_;
  double drift_keep_;   // exp(-T / tau)
  double drift_drive_;  // sqrt(1 - keep^2) * sigma: the exact discretisation, stationary from the first sample
  Eigen::Vector3d drift_W_m_ = Eigen::Vector3d::Zero();
  std::int64_t last_arrival_ns_ = 0;
  std::array<PoseArrival, kQueue> queue_{};
  std::size_t head_ = 0;
  std::size_t count_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace rotorloop::sim
