// The moments that the rotor speeds predict against what the vehicle did, sample by sample: this identifies which rotor a column is, and
// when one of them was scaled. Private to the checks.
#pragma once
#include <array>
#include <functional>
#include <vector>

#include "bench/sysid/log/check/check_steps.hpp"

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
  double thrust_g = 1.0;           // specific force along z, over g: as felt, not as the speeds say
};

inline constexpr std::size_t kMomentStride = 8;  // of the checks' grid: 50 Hz, for what was filtered at 5 Hz

// Empty without rotor speeds, or without gyro and attitude. `in_flight`: on the grid of `g`.
std::vector<MomentSample> moment_samples(const FlightGrid& g, const std::vector<char>& in_flight, const host::VehicleModel& vehicle);

using Imbalance = std::array<double, 3>;  // in roll, pitch and yaw, as `moment`

struct Unexplained {
  std::vector<Imbalance> imbalance;  // sample by sample, without what a sound log explains
  Imbalance constant{};              // of the fit, in hover: what the whole flight leaves
  double mean_square = 0.0;          // of all three axes, over the samples of the fit
};
// Regression of each axis on what moves a sound vehicle: its own acceleration and rates (which is also what each hub's own motion through
// the air does), products of rates, velocity, spin-up, and thrust times a centre of mass off the middle. Fitted to the samples that are
// valid and of which `sound(i)` is true.
Unexplained unexplained_moments(const std::vector<MomentSample>& samples, const std::function<bool(std::size_t)>& sound);

// Looks at hover, and at samples that are valid; `up`: specific force along the thrust axis on the grid of `g`.
void check_hover(CheckState& s, const FlightGrid& g, const std::vector<double>& up, const std::vector<char>& in_flight);

// These look at samples that are valid and in flight; see the files.
void check_rotor_slip(CheckState& s, const Grid& grid, const std::vector<char>& in_flight);
void check_rotor_order(CheckState& s, const Grid& grid, const std::vector<char>& in_flight);
void check_rotor_scale(CheckState& s, const FlightGrid& g, std::vector<char> in_flight);

}  // namespace rotorloop::log
