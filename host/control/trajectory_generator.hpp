// Makes flights: minimum-snap (order 7) pieces, from rest to rest or through waypoints. Enough for the shipped flights and for
// quick experiments; it is no planner and knows no obstacles. Hosts only, before flight: it uses the heap.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "host/control/trajectory.hpp"
#include "host/control/trajectory_file.hpp"

namespace rotorloop::host {

struct Waypoint {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  double time_s = 0.0;  // since the first waypoint, increasing
};

// From rest to rest over length L in time T the septic 35τ⁴ - 84τ⁵ + 70τ⁶ - 20τ⁷ peaks at these multiples of L/T and L/T².
inline constexpr double kPeakVelocity = 2.1875;
inline constexpr double kPeakAcceleration = 7.51318840439929;  // at τ = 1/2 ± 1/sqrt(20)

// One segment; velocity, acceleration and jerk are zero at both ends.
Segment rest_to_rest(const Waypoint& from, const Waypoint& to);
Segment hover(const Eigen::Vector3d& p_W_m, double yaw_rad, double duration_s);

// Minimum snap through all waypoints, at rest (to jerk) at the first and the last: the septic spline whose first six
// derivatives are continuous. At least two waypoints, at most kMaxSegments + 1; throws Error otherwise.
std::vector<Segment> through(const std::vector<Waypoint>& waypoints);

Trajectory join(const std::vector<Segment>& segments);  // throws Error beyond kMaxSegments

// Extremes over a whole trajectory, sampled every `step_s`. Attitude follows from flatness without drag.
struct Peaks {
  double speed_m_s = 0.0, speed_xy_m_s = 0.0, speed_z_m_s = 0.0;
  double accel_m_s2 = 0.0;
  double tilt_rad = 0.0;
  double roll_rate_rad_s = 0.0, pitch_rate_rad_s = 0.0, yaw_rate_rad_s = 0.0;  // yaw: of the heading
  double yaw_accel_rad_s2 = 0.0;
  double thrust_weight_min = 1.0, thrust_weight_max = 1.0;  // thrust over weight
};
Peaks peaks(const Trajectory& trajectory, double step_s = 1e-3);

// The same path in `factor` times the time: speeds fall by it, accelerations by its square. Throws Error below 1: a flight that was checked
// for a vehicle stays within what was checked.
TrajectoryFile slowed(const TrajectoryFile& file, double factor);

// What a flight may ask for; zero or infinite where nothing limits.
struct TrajectoryLimits {
  double speed_m_s, thrust_weight, tilt_rad;  // speed as a vector; thrust over weight, without drag
};
// The least factor, 1 or more, at which slowed() keeps the limits; a limit that no factor keeps (thrust_weight of 1 or less) throws Error.
double slowing(const Trajectory& trajectory, const TrajectoryLimits& limits);

// The shipped flights (scenarios/trajectories), after the paper's Figs 9 to 11 …
TrajectoryFile horizontal_8p5();      // back and forth along x: 8.5 m/s, 10.8 m/s²
TrajectoryFile vertical_3p1();        // up and down: ±3.1 m/s, 2.0 m/s²
TrajectoryFile vertical_3p1_brisk();  // the same speed at 4.5 m/s²: thrust far from hover
TrajectoryFile general();             // 5.7 m/s, 2 m/s up and down, roll and pitch about 2 rad/s, yaw 5.5 rad/s
// … those of scenarios/identify.toml, after the paper's section V: one for each group of parameters …
TrajectoryFile identify_vertical();    // up and down: ±3.5 m/s, 2.5 m/s²: thrust model, centre of mass, sensor
TrajectoryFile identify_horizontal();  // 10.5 m/s along x and y, 12 and 9 m/s²: drag
TrajectoryFile identify_rotation();    // about all three axes at once, 6.5 rad/s each: inertia, yaw torque
// … and those of scenarios/effects.toml, for effects that the paper's flights do not meet.
TrajectoryFile fast_descent();   // ±5 m/s vertically: through the vortex ring
TrajectoryFile low_hover();      // staircase from 0.5 m down to 0.15 m: ground effect
TrajectoryFile ceiling_hover();  // staircase from 2 m up to 2.9 m: ceiling effect
// … and the three of scenarios/diagnose.toml, 20 s each, that excite every effect of the catalogue between them.
TrajectoryFile diagnose_vertical();    // between ground and ceiling, 3.3 m/s
TrajectoryFile diagnose_horizontal();  // out and back at several speeds and headings, 9.3 m/s
TrajectoryFile diagnose_rotation();    // about three axes while climbing; then down through the vortex ring

}  // namespace rotorloop::host
