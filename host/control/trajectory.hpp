// A flight as piecewise polynomials: evaluated in the loop, without heap. Reading and writing the file is
// trajectory_file.hpp (hosts only), making the shipped flights is trajectory_generator.hpp.
#pragma once
#include <array>
#include <cstddef>

#include "host/control/setpoint.hpp"

namespace rotorloop::host {

inline constexpr std::size_t kMaxSegments = 128;
inline constexpr std::size_t kCoefficients = 8;  // order 7: minimum snap between rest points

// c0 + c1 t + … + c7 t⁷ with t in seconds since the segment's start.
struct Polynomial {
  std::array<double, kCoefficients> c{};
  // Derivative `n` at t. n <= 7.
  double at(double t_s, std::size_t n) const;
  bool constant() const;
};

struct Segment {
  double duration_s = 0.0;
  Polynomial x_m, y_m, z_m, yaw_rad;
};

struct Trajectory {
  std::array<Segment, kMaxSegments> segments{};
  std::size_t count = 0;

  double duration_s() const;
  // Time is clamped at both ends: before the start the first point, after the end the last one, both at rest.
  // A time that is not a number is taken as 0.
  Setpoint at(double t_s) const;
  // From when to when the set-point moves (position or yaw): the span over which tracking error is averaged. Both 0 when it
  // never moves. Segment boundaries, because a polynomial that moves at all moves within its whole segment.
  double first_motion_s() const;
  double last_motion_s() const;
};

}  // namespace rotorloop::host
