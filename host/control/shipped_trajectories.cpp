// The flights of scenarios/trajectories, after the paper's Figs 9 to 11. Peaks are reached exactly: a rest-to-rest piece by its
// length and time, the general flight by scaling (a spline is linear in its waypoints, and time scales all its rates).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/control/trajectory_generator.hpp"

namespace rotorloop::host {

namespace {

constexpr double kHoverBefore_s = 2.0, kHoverAfter_s = 1.0;
const Eigen::Vector3d kStart_W_m{0.0, 0.0, 2.0};

// Back and forth along `direction`, `runs` times, each run peaking at the given speed and acceleration.
Trajectory shuttle(const Eigen::Vector3d& direction, double speed_m_s, double accel_m_s2, int runs) {
  const double time_s = (kPeakAcceleration / accel_m_s2) * (speed_m_s / kPeakVelocity);
  const double length_m = speed_m_s * time_s / kPeakVelocity;
  const Eigen::Vector3d far = kStart_W_m + direction * length_m;
  std::vector<Segment> segments{hover(kStart_W_m, 0.0, kHoverBefore_s)};
  for (int i = 0; i < runs; ++i)
    segments.push_back(rest_to_rest({.p_W_m = i % 2 ? far : kStart_W_m}, {.p_W_m = i % 2 ? kStart_W_m : far, .time_s = time_s}));
  segments.push_back(hover(runs % 2 ? far : kStart_W_m, 0.0, kHoverAfter_s));
  return join(segments);
}

}  // namespace

TrajectoryFile horizontal_8p5() { return {"horizontal, 8.5 m/s", shuttle(Eigen::Vector3d::UnitX(), 8.5, 10.8, 8)}; }

TrajectoryFile vertical_3p1() { return {"vertical, 3.1 m/s", shuttle(Eigen::Vector3d::UnitZ(), 3.1, 4.5, 8)}; }

TrajectoryFile general() {
  constexpr double kSpeedXy_m_s = 5.7, kSpeedZ_m_s = 2.0, kYawRate_rad_s = 5.5;
  constexpr double kTurn = 2.0 * std::numbers::pi;
  // A figure of eight, a climbing turn with a full turn of yaw, a dash with the nose swung back, and home.
  std::vector<Waypoint> path{
      {.p_W_m = {0.0, 0.0, 0.0}, .yaw_rad = 0.0, .time_s = 0.0},        {.p_W_m = {2.2, 1.5, 0.5}, .yaw_rad = 0.6, .time_s = 1.3},
      {.p_W_m = {4.6, 0.0, 1.0}, .yaw_rad = -0.4, .time_s = 2.1},       {.p_W_m = {7.0, -1.5, 0.4}, .yaw_rad = 0.0, .time_s = 2.9},
      {.p_W_m = {8.4, 0.2, 0.0}, .yaw_rad = 0.3 * kTurn, .time_s = 3.8}, {.p_W_m = {7.0, 1.8, 0.6}, .yaw_rad = 0.85 * kTurn, .time_s = 4.7},
      {.p_W_m = {4.6, 0.2, 1.4}, .yaw_rad = kTurn, .time_s = 5.6},      {.p_W_m = {2.0, -1.6, 0.8}, .yaw_rad = kTurn, .time_s = 6.5},
      {.p_W_m = {0.2, 0.0, 0.0}, .yaw_rad = 0.8 * kTurn, .time_s = 7.4}, {.p_W_m = {1.6, 2.0, 0.6}, .yaw_rad = 0.35 * kTurn, .time_s = 8.4},
      {.p_W_m = {4.6, 2.2, 1.2}, .yaw_rad = 0.0, .time_s = 9.3},        {.p_W_m = {7.2, 0.4, 0.5}, .yaw_rad = -0.3, .time_s = 10.2},
      {.p_W_m = {4.8, -1.2, 0.0}, .yaw_rad = 0.4, .time_s = 11.2},      {.p_W_m = {2.0, -0.4, 0.3}, .yaw_rad = 0.0, .time_s = 12.2},
      {.p_W_m = {0.0, 0.0, 0.0}, .yaw_rad = 0.0, .time_s = 13.6}};
  // Time by the horizontal speed; then height and yaw by their own rates, which the new time has changed.
  const Peaks raw = peaks(join(through(path)));
  for (Waypoint& w : path) w.time_s *= raw.speed_xy_m_s / kSpeedXy_m_s;
  const Peaks timed = peaks(join(through(path)));
  for (Waypoint& w : path) {
    w.p_W_m.z() *= kSpeedZ_m_s / timed.speed_z_m_s;
    w.yaw_rad *= kYawRate_rad_s / timed.yaw_rate_rad_s;
    w.p_W_m += kStart_W_m;
  }
  std::vector<Segment> segments{hover(path.front().p_W_m, path.front().yaw_rad, kHoverBefore_s)};
  for (const Segment& s : through(path)) segments.push_back(s);
  segments.push_back(hover(path.back().p_W_m, path.back().yaw_rad, kHoverAfter_s));
  return {"general: figure of eight, climbing turns, yaw", join(segments)};
}

}  // namespace rotorloop::host
