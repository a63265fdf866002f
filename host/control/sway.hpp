// Waypoints of a flight that shakes the vehicle about all axes: sideways sways so quick that it has to swing through large tilts,
// each axis sweeping its own band, while the heading turns to and fro and thrust rises and falls. Roll, pitch and yaw then overlap
// in every combination: the products of rates carry I_zz apart from c_q, which yaw alone does not.
#pragma once
#include <vector>

#include "host/control/trajectory_generator.hpp"

namespace rotorloop::host {

// A linear sweep of the angular frequency over the flight.
struct Sweep {
  double from_rad_s = 0.0, to_rad_s = 0.0;
};

struct Sway {
  double span_s = 20.0, ramp_s = 2.0;  // whole flight; its amplitude fades in and out over ramp_s
  std::size_t pieces = 110;
  double sway_m = 0.12, heave_m = 0.12, turn_rad = 6.0;  // shares among each other; sway and turn are scaled to the peaks below
  Sweep x, y, z, yaw;
  double roll_pitch_rate_rad_s = 0.0;  // peak of the larger one, from flatness without drag
  double yaw_rate_rad_s = 0.0;         // peak of the heading's rate
};

// Around the origin, at rest there at both ends.
std::vector<Waypoint> sway(const Sway& wanted);

}  // namespace rotorloop::host
