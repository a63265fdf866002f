// The inertial sensor: what gyro and accelerometer at the centre of mass report, with turn-on bias, white noise and the
// vibration of four unbalanced rotors. Quantisation is left to the wire format.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "host/base/random.hpp"
#include "sim/airframe/airframe.hpp"

namespace rotorloop::sim {

struct ImuConfig {
  std::int64_t rate_Hz = 1000;
  double gyro_noise_rad_s = 0.01;  // standard deviation of a sample, per axis
  double accel_noise_m_s2 = 0.15;  // standard deviation of a sample, per axis
  double gyro_bias_rad_s = 0.005;  // standard deviation of the constant turn-on bias, per axis
  double accel_bias_m_s2 = 0.05;   // standard deviation of the constant turn-on bias, per axis
  double vibration = 1.0;          // scales the unbalance of all rotors; 0: balanced
  double rectification_m = 0.0;    // of vibration: bias on z per square of the mean rotor speed; a defect, set by an effect
  // What it makes of true rates and specific forces before bias and noise; defects (turned, scaled), set by effects.
  Eigen::Matrix3d gyro_gain = Eigen::Matrix3d::Identity(), accel_gain = Eigen::Matrix3d::Identity();
};

// Unbalance of one rotor at vibration = 1: mass times eccentricity. Between the balance grades G16 and G40 of ISO 21940-11
// for 18 g of bell and propeller at 945 rad/s (e * omega = 16 to 40 mm/s); gives about 0.5 m/s^2 per rotor in hover on the
// reference body, within what flight stacks call good (below 15 m/s^2).
inline constexpr double kUnbalance_kg_m = 4e-7;
// Out-of-plane force once per revolution, from blades that do not track, as a fraction of the in-plane one. Estimate.
inline constexpr double kTrackRatio = 0.5;

struct ImuReading {
  std::int64_t time_ns = 0;
  Eigen::Vector3d gyro_B_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_B_m_s2 = Eigen::Vector3d::Zero();  // specific force: +g on z at rest
};

class ImuSensor {
 public:
  // The body (mass, inertia, hubs) decides how a rotor's unbalance shakes it: in-plane force U omega^2 turning with the
  // rotor at its hub; acceleration F/m grows with omega^2, the rate it leaves after integration with omega.
  ImuSensor(const ImuConfig& config, const AirframeConfig& body, std::uint64_t seed);

  // Instant of sample n, counted from the start of the airframe's clock.
  std::int64_t time_of_sample_ns(std::int64_t n) const { return n * 1'000'000'000 / config_.rate_Hz; }
  // Sample n (0, 1, 2 … in order); the reading carries state.time_ns. `omega` are the shaft speeds now.
  ImuReading sample(std::int64_t n, const AirframeState& state, std::span<const double, kAirframeRotors> omega_rad_s);

  const Eigen::Vector3d& gyro_bias_B_rad_s() const { return gyro_bias_B_rad_s_; }
  const Eigen::Vector3d& accel_bias_B_m_s2() const { return accel_bias_B_m_s2_; }

 private:
  using Response = Eigen::Matrix<double, 3, 2>;  // to the (cosine, sine) of the rotor angle, per omega^2
  struct Shaker {
    Response accel_m_s2;
    Response angular_rad_s2;
    double phase_rad = 0.0;
    double last_omega_rad_s = 0.0;
  };

  ImuConfig config_;
  RandomStream noise_;
  Eigen::Vector3d gyro_bias_B_rad_s_;
  Eigen::Vector3d accel_bias_B_m_s2_;
  std::array<Shaker, kAirframeRotors> shakers_;
  std::int64_t last_n_ = -1;
};

}  // namespace rotorloop::sim
