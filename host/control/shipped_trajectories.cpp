// The flights of scenarios/trajectories, after the paper's Figs 9 to 11, three for identification, and three that show effects at
// boundaries. Peaks are reached exactly: a rest-to-rest piece by its length and time, the general flight by scaling (a spline is linear in
// its waypoints, and time scales all its rates).
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>

#include "host/base/elementary.hpp"
#include "host/control/sway.hpp"
#include "host/control/trajectory_generator.hpp"

namespace rotorloop::host {

namespace {

constexpr double kHoverBefore_s = 2.0, kHoverAfter_s = 1.0;
const Eigen::Vector3d kStart_W_m{0.0, 0.0, 2.0};

// Back and forth along `direction`, `runs` times from kStart_W_m, each run peaking at the given speed and acceleration.
std::vector<Segment> shuttle_runs(const Eigen::Vector3d& direction, double speed_m_s, double accel_m_s2, int runs) {
  const double time_s = (kPeakAcceleration / accel_m_s2) * (speed_m_s / kPeakVelocity);
  const double length_m = speed_m_s * time_s / kPeakVelocity;
  const Eigen::Vector3d far = kStart_W_m + direction * length_m;
  std::vector<Segment> segments;
  for (int i = 0; i < runs; ++i)
    segments.push_back(rest_to_rest({.p_W_m = i % 2 ? far : kStart_W_m}, {.p_W_m = i % 2 ? kStart_W_m : far, .time_s = time_s}));
  return segments;
}

// The same with hover before and after; an even number of runs ends where it began.
Trajectory shuttle(const Eigen::Vector3d& direction, double speed_m_s, double accel_m_s2, int runs) {
  std::vector<Segment> segments{hover(kStart_W_m, 0.0, kHoverBefore_s)};
  for (const Segment& s : shuttle_runs(direction, speed_m_s, accel_m_s2, runs)) segments.push_back(s);
  segments.push_back(hover(kStart_W_m, 0.0, kHoverAfter_s));
  return join(segments);
}

// Through all heights above the origin, one second on the way and one second at each.
Trajectory staircase(std::initializer_list<double> heights_m) {
  std::vector<Segment> segments;
  Eigen::Vector3d at_W_m{0.0, 0.0, *heights_m.begin()};
  for (const double z_m : heights_m) {
    const Eigen::Vector3d next_W_m{0.0, 0.0, z_m};
    if (!segments.empty()) segments.push_back(rest_to_rest({.p_W_m = at_W_m}, {.p_W_m = next_W_m, .time_s = 1.0}));
    segments.push_back(hover(next_W_m, 0.0, segments.empty() ? kHoverBefore_s : kHoverAfter_s));
    at_W_m = next_W_m;
  }
  return join(segments);
}

}  // namespace

TrajectoryFile horizontal_8p5() { return {"horizontal, 8.5 m/s", shuttle(Eigen::Vector3d::UnitX(), 8.5, 10.8, 8)}; }

TrajectoryFile vertical_3p1() { return {"vertical, 3.1 m/s", shuttle(Eigen::Vector3d::UnitZ(), 3.1, 2.0, 4)}; }

TrajectoryFile vertical_3p1_brisk() { return {"vertical, 3.1 m/s, 4.5 m/s2", shuttle(Eigen::Vector3d::UnitZ(), 3.1, 4.5, 8)}; }

TrajectoryFile fast_descent() { return {"up and down, 5 m/s", shuttle(Eigen::Vector3d::UnitZ(), 5.0, 4.0, 4)}; }

TrajectoryFile low_hover() { return {"hover at 0.5 m to 0.15 m above ground", staircase({0.5, 0.35, 0.25, 0.15, 0.25, 0.5})}; }

TrajectoryFile ceiling_hover() { return {"hover up to 0.1 m below a height of 3 m", staircase({2.0, 2.7, 2.8, 2.9, 2.8, 2.0})}; }

TrajectoryFile general() {
  constexpr double kSpeedXy_m_s = 5.7, kSpeedZ_m_s = 2.0, kYawRate_rad_s = 5.5;
  // Two laps of a figure of eight, x = a sin θ, y = b sin 2θ, rising and falling twice a lap. θ gains speed over the first
  // and loses it over the last kRamp_s. Yaw sways in the first lap; in the second it makes a full turn and goes back.
  constexpr double kLong_m = 4.2, kWide_m = 1.9, kLap = 2.0 * std::numbers::pi, kRate_rad_s = 1.0, kRamp_s = 2.5;
  constexpr std::size_t kPieces = 20;
  constexpr std::array<double, kPieces + 1> kYaw_turns{0,   0,   0.03, 0.06, 0, -0.06, -0.03, 0.03, 0.06, 0, 0,
                                                       0.1, 0.6, 0.95, 1,    1, 0.9,   0.4,   0.05, 0,    0};
  constexpr double kRampAngle = 0.5 * kRate_rad_s * kRamp_s, kWhole_s = 2.0 * kLap / kRate_rad_s + kRamp_s;
  const auto time_at = [&](double theta) {
    if (theta < kRampAngle) return std::sqrt(2.0 * theta * kRamp_s / kRate_rad_s);
    if (theta > 2.0 * kLap - kRampAngle) return kWhole_s - std::sqrt(2.0 * std::max(2.0 * kLap - theta, 0.0) * kRamp_s / kRate_rad_s);
    return theta / kRate_rad_s + 0.5 * kRamp_s;
  };
  std::vector<Waypoint> path;
  for (std::size_t i = 0; i <= kPieces; ++i) {
    const double theta = 2.0 * kLap * static_cast<double>(i) / static_cast<double>(kPieces);
    path.push_back({.p_W_m = {kLong_m * sin_exact(theta), kWide_m * sin_exact(2.0 * theta), 1.0 - cos_exact(2.0 * theta)},
                    .yaw_rad = kLap * kYaw_turns[i],
                    .time_s = time_at(theta)});
  }
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

TrajectoryFile identify_vertical() { return {"identification, vertical, 3.5 m/s", shuttle(Eigen::Vector3d::UnitZ(), 3.5, 2.5, 6)}; }

TrajectoryFile identify_horizontal() {
  // Along x and along y, so that neither drag nor centre of mass of one axis is inferred from the other. Every second pair of runs is
  // gentler: at equal speed the rotors then carry less, which separates drag per thrust (eq. 4) from drag of the airframe (eq. 5).
  constexpr double kSpeed_m_s = 10.5, kBrisk_m_s2 = 12.0, kGentle_m_s2 = 9.0;
  std::vector<Segment> segments{hover(kStart_W_m, 0.0, kHoverBefore_s)};
  for (const double accel_m_s2 : {kBrisk_m_s2, kGentle_m_s2})
    for (const Eigen::Vector3d& direction : {Eigen::Vector3d(Eigen::Vector3d::UnitX()), Eigen::Vector3d(Eigen::Vector3d::UnitY())}) {
      const std::vector<Segment> runs = shuttle_runs(direction, kSpeed_m_s, accel_m_s2, 2);
      segments.insert(segments.end(), runs.begin(), runs.end());
    }
  segments.push_back(hover(kStart_W_m, 0.0, kHoverAfter_s));
  return {"identification, horizontal, 10.5 m/s", join(segments)};
}

TrajectoryFile identify_rotation() {
  // Planned a little below 6.5 rad/s: flown with vehicles/reference_guess.toml the loops overshoot, roll to 6.6, pitch 6.2, yaw 6.3 rad/s.
  std::vector<Waypoint> path =
      sway({.x = {5.0, 8.0}, .y = {8.0, 5.5}, .z = {4.0, 5.5}, .yaw = {0.8, 1.2}, .roll_pitch_rate_rad_s = 6.2, .yaw_rate_rad_s = 4.9});
  for (Waypoint& w : path) w.p_W_m += kStart_W_m;
  std::vector<Segment> segments{hover(kStart_W_m, 0.0, kHoverBefore_s)};
  for (const Segment& s : through(path)) segments.push_back(s);
  segments.push_back(hover(kStart_W_m, 0.0, kHoverAfter_s));
  return {"identification, rotation about three axes, 6.5 rad/s", join(segments)};
}

}  // namespace rotorloop::host
