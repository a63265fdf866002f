// Draws the noise of a sample by its number and shakes the reading with the rotors.
#include "sim/sensor/imu.hpp"

#include <Eigen/Dense>
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/sensor/gaussian3.hpp"

namespace rotorloop::sim {
namespace {

// Modules of the random streams: four letters each, so that no other user picks the same by accident.
constexpr std::uint64_t kImuNoiseModule = 0x494D554E;  // IMUN
constexpr std::uint64_t kTurnOnModule = 0x494D5542;    // IMUB
constexpr std::uint64_t kPhaseModule = 0x494D5550;     // IMUP
constexpr std::uint64_t kImuDraws = 6;
constexpr double kTurn_rad = 2.0 * std::numbers::pi;

}  // namespace

ImuSensor::ImuSensor(const ImuConfig& config, const AirframeConfig& body, std::uint64_t seed)
    : config_(config), noise_(seed, kImuNoiseModule) {
  const RandomStream turn_on(seed, kTurnOnModule), phase(seed, kPhaseModule);
  gyro_bias_B_rad_s_ = config_.gyro_bias_rad_s * gaussian3(turn_on, 0);
  accel_bias_B_m_s2_ = config_.accel_bias_m_s2 * gaussian3(turn_on, 3);
  const Eigen::Matrix3d inverse_inertia = body.inertia_kg_m2.inverse();
  for (std::size_t i = 0; i < kAirframeRotors; ++i) {
    const double U_kg_m = config_.vibration * kUnbalance_kg_m;
    Response force_per_omega2;  // turns with the rotor: cosine along x, spin * sine along y; the track error with the cosine
    force_per_omega2 << U_kg_m, 0.0, 0.0, U_kg_m * body.rotors[i].spin, kTrackRatio * U_kg_m, 0.0;
    const Eigen::Vector3d arm_B_m = body.rotors[i].hub_m - body.com_offset_m;
    shakers_[i].accel_m_s2 = force_per_omega2 / body.mass_kg;
    for (Eigen::Index k = 0; k < 2; ++k)
      shakers_[i].angular_rad_s2.col(k) = inverse_inertia * arm_B_m.cross(Eigen::Vector3d(force_per_omega2.col(k)));
    shakers_[i].phase_rad = kTurn_rad * phase.uniform(i);
  }
}

ImuReading ImuSensor::sample(std::int64_t n, const AirframeState& state, std::span<const double, kAirframeRotors> omega_rad_s) {
  const double since_last_s = last_n_ < 0 ? 0.0 : static_cast<double>(n - last_n_) / static_cast<double>(config_.rate_Hz);
  last_n_ = n;
  ImuReading r{state.time_ns, config_.gyro_gain * state.w_B_rad_s + gyro_bias_B_rad_s_,
               config_.accel_gain * state.specific_force_B_m_s2 + accel_bias_B_m_s2_};
  for (std::size_t i = 0; i < kAirframeRotors; ++i) {
    Shaker& s = shakers_[i];
    const double omega = omega_rad_s[i];
    s.phase_rad += 0.5 * (omega + s.last_omega_rad_s) * since_last_s;
    s.phase_rad -= kTurn_rad * std::floor(s.phase_rad / kTurn_rad);
    s.last_omega_rad_s = omega;
    const SinCos p = sincos_exact(s.phase_rad);
    r.accel_B_m_s2 += (omega * omega) * (s.accel_m_s2 * Eigen::Vector2d(p.cos, p.sin));
    r.gyro_B_rad_s += omega * (s.angular_rad_s2 * Eigen::Vector2d(p.sin, -p.cos));  // integral of omega^2 (cos, sin)
  }
  if (config_.rectification_m != 0.0) {
    double square = 0.0;
    for (const double omega : omega_rad_s) square += omega * omega / static_cast<double>(kAirframeRotors);
    r.accel_B_m_s2.z() += config_.rectification_m * square;
  }
  const auto first = static_cast<std::uint64_t>(n) * kImuDraws;
  r.gyro_B_rad_s += config_.gyro_noise_rad_s * gaussian3(noise_, first);
  r.accel_B_m_s2 += config_.accel_noise_m_s2 * gaussian3(noise_, first + 3);
  return r;
}

}  // namespace rotorloop::sim
