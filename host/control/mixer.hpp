// From total thrust and torque to four rotor speeds: eq. (1)-(3) solved together by Newton's method on ω², with c_t from the
// table and the centre of mass where the vehicle file has it. When the rotors cannot deliver everything, yaw torque gives way
// first, then total thrust, then roll and pitch torque.
#pragma once
#include <Eigen/Core>
#include <array>

#include "host/control/thrust_table.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::host {

struct MixerConfig {
  ThrustLookup lookup = ThrustLookup::full;
  bool local_velocity = true;       // each rotor sees v + w × arm, not the velocity of the centre of mass
  double omega_min_rad_s = 250.0;   // about 2400 RPM: below it a sensorless observer is not trusted
  double omega_max_rad_s = 1780.2;  // 17 000 RPM, the flight limit of the reference drive
};

struct MixerDemand {
  double thrust_N = 0.0;  // along +z of B
  Eigen::Vector3d torque_B_N_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_B_m_s = Eigen::Vector3d::Zero();  // centre of mass through the air
  Eigen::Vector3d w_B_rad_s = Eigen::Vector3d::Zero();
};

struct MixerResult {
  std::array<double, kRotors> omega_rad_s{};
  int iterations = 0;
  double residual_rad_s = 0.0;  // size of the last Newton step
  bool yaw_limited = false;     // the limits that acted
  bool thrust_limited = false;
  bool torque_limited = false;  // roll and pitch torque, the last resort
  bool table_edge = false;
};

// What four speeds give by the mixer's own model.
struct MixerWrench {
  double thrust_N = 0.0;
  Eigen::Vector3d torque_B_N_m = Eigen::Vector3d::Zero();
};

class Mixer {
 public:
  static constexpr int kMaxIterations = 6;
  static constexpr double kConverged_rad_s = 0.05;  // 0.5 RPM, below the resolution of a speed command

  // The rotors must span an area around the centre of mass (the vehicle reader checks it).
  Mixer(const VehicleModel& vehicle, const MixerConfig& config);

  // `guess_rad_s`: where to start, usually the last command. The demand must be finite.
  MixerResult solve(const MixerDemand& demand, const std::array<double, kRotors>& guess_rad_s) const;

  // The other way round: thrust and torque of these speeds, under the model that solve() inverts.
  MixerWrench wrench(const std::array<double, kRotors>& omega_rad_s, const Eigen::Vector3d& v_B_m_s,
                     const Eigen::Vector3d& w_B_rad_s) const;

  const MixerConfig& config() const { return config_; }
  double hover_omega_rad_s() const { return hover_omega_rad_s_; }

 private:
  using Vector4 = Eigen::Matrix<double, kRotors, 1>;
  struct Bounds;
  Eigen::Vector3d hub_velocity_m_s(int rotor, const Eigen::Vector3d& v_B_m_s, const Eigen::Vector3d& w_B_rad_s) const;
  bool shape(const Bounds& bounds, double yaw_base_N_m, const Vector4& yaw_per_N, MixerDemand& demand, Vector4& thrust_N,
             MixerResult& flags) const;

  MixerConfig config_;
  ThrustTable table_;
  double c_q_N_m_s2_, radius_m_;
  AdvanceModel advance_;
  double hover_omega_rad_s_;
  std::array<Eigen::Vector3d, kRotors> arm_m_;
  Vector4 reaction_;
  // Thrusts for (total thrust, τx, τy), least in norm; and the direction in which thrusts change without changing those.
  Eigen::Matrix<double, kRotors, 3> from_wrench_;
  Vector4 free_direction_;
};

}  // namespace rotorloop::host
