// The moments that the rotor speeds predict against what the vehicle did, sample by sample: this identifies which rotor a column is, and when
// one of them was scaled. Private to the checks.
#pragma once
#include <array>
#include <vector>

#include "bench/log/check/check_steps.hpp"

namespace rotorloop::log {

// Directions in which one rotor's thrust leaves a moment, as signs in roll, pitch and yaw: sign of y, sign of x, reaction.
std::array<double, 3> moment_signs(const host::VehicleModel& vehicle, std::size_t rotor);

struct MomentSample {
  double t_s = 0.0;
  bool valid = false;
  RotorValues square{};  // ω², over the flight's median sum of four
  Eigen::Vector3d rate_B_rad_s, acceleration_B_rad_s2, velocity_B_m_s;
  std::array<double, 3> moment{};  // of `square` over the mean arm: roll Σ q y, pitch Σ q x, yaw Σ q reaction
  double spin_s = 0.0;             // Σ reaction dω/dt over the median speed: what the rotors' own inertia gives to yaw
};

inline constexpr std::size_t kMomentStride = 8;  // of the checks' grid: 50 Hz, for what was filtered at 5 Hz

// Empty without rotor speeds, or without gyro and attitude. `in_flight`: on the grid of `g`.
std::vector<MomentSample> moment_samples(const FlightGrid& g, const std::vector<char>& in_flight, const host::VehicleModel& vehicle);

// Both look at samples that are valid and in flight, and judge by roll, pitch and yaw together; see the files.
void check_rotor_order(CheckState& s, const FlightGrid& g, const std::vector<char>& in_flight);
void check_rotor_scale(CheckState& s, const FlightGrid& g, std::vector<char> in_flight);

}  // namespace rotorloop::log
