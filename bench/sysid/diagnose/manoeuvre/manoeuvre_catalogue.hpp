// Short flights that could be flown next, as paths over time: what manoeuvre_search tries in simulation when flights so far leave
// effects that look alike. Sizes are those of the reference quadrotor (0.125 m from hub to middle); another vehicle flies them dynamically
// alike (term_size.hpp): lengths with its arm, times with the root of its arm, tilts and accelerations the same.
#pragma once
#include <Eigen/Core>
#include <span>
#include <string>

namespace rotorloop::diagnose {

inline constexpr double kManoeuvre_s = 10.0;  // of every manoeuvre, on any vehicle

struct PathPoint {
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();  // x, y, and z as the level says
  double yaw_rad = 0.0;
};

// What a height counts from: a place in free air, the ground (upwards), the ceiling (downwards, the gap above the hubs).
enum class Level { free_air, ground, ceiling };

struct Manoeuvre {
  const char* id;
  const char* words;  // for people; {} stands for the figure
  double figure = 0;  // of the reference quadrotor at full size: the largest speed, tilt or change of thrust
  const char* unit = "";
  Level level = Level::free_air;
  PathPoint (*at)(double t_s, double share) = nullptr;  // at rest at t = 0 and before; smooth to the third derivative
  double payload_share = 0.0;                           // weighed load at the centre of mass, of the vehicle's mass
};

std::span<const Manoeuvre> manoeuvres();

// Where the vehicle of `length_ratio` (its arm over the reference's) shall be; `share`: of the full size, in way, speed and acceleration
// (heights above ground and below a ceiling stay, and turns that no rotor feels).
PathPoint path_point(const Manoeuvre& manoeuvre, double t_s, double length_ratio, double share);

// "straight runs along x and back, up to 6.0 m/s", with the figure as this vehicle flies it.
std::string manoeuvre_words(const Manoeuvre& manoeuvre, double length_ratio, double share);

}  // namespace rotorloop::diagnose
