#include "host/control/trajectory_generator.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "host/base/elementary.hpp"
#include "host/base/error.hpp"
#include "host/control/attitude.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::host {

namespace {

// Coefficients over τ = t/T become coefficients over t.
Polynomial in_seconds(const std::array<double, kCoefficients>& c, double duration_s) {
  Polynomial out;
  double scale = 1.0;
  for (std::size_t k = 0; k < kCoefficients; ++k, scale /= duration_s) out.c[k] = c[k] * scale;
  return out;
}

Polynomial step(double from, double to, double duration_s) {
  const double d = to - from;
  return in_seconds({from, 0, 0, 0, 35 * d, -84 * d, 70 * d, -20 * d}, duration_s);
}

double falling(std::size_t k, std::size_t n) {  // k! / (k-n)!
  double f = 1.0;
  for (std::size_t i = 0; i < n; ++i) f *= static_cast<double>(k) - static_cast<double>(i);
  return f;
}

}  // namespace

Segment rest_to_rest(const Waypoint& from, const Waypoint& to) {
  Segment s;
  s.duration_s = to.time_s - from.time_s;
  s.x_m = step(from.p_W_m.x(), to.p_W_m.x(), s.duration_s);
  s.y_m = step(from.p_W_m.y(), to.p_W_m.y(), s.duration_s);
  s.z_m = step(from.p_W_m.z(), to.p_W_m.z(), s.duration_s);
  s.yaw_rad = step(from.yaw_rad, to.yaw_rad, s.duration_s);
  return s;
}

Segment hover(const Eigen::Vector3d& p_W_m, double yaw_rad, double duration_s) {
  Segment s;
  s.duration_s = duration_s;
  s.x_m.c[0] = p_W_m.x();
  s.y_m.c[0] = p_W_m.y();
  s.z_m.c[0] = p_W_m.z();
  s.yaw_rad.c[0] = yaw_rad;
  return s;
}

std::vector<Segment> through(const std::vector<Waypoint>& waypoints) {
  if (waypoints.size() < 2 || waypoints.size() > kMaxSegments + 1)
    throw Error({"", fmt::format("{} waypoints, expected 2 to {}", waypoints.size(), kMaxSegments + 1), "", "split the flight"});
  for (std::size_t i = 1; i < waypoints.size(); ++i)
    if (!(waypoints[i].time_s > waypoints[i - 1].time_s))
      throw Error({"", fmt::format("waypoint {} is at {} s, not after the one before it", i + 1, waypoints[i].time_s), "",
                   "give increasing times"});

  // Unknown: eight coefficients over τ in [0, 1] per segment. Rows: both end points of each segment, rest at both ends of the
  // flight, six continuous derivatives at each inner waypoint. One matrix, four right-hand sides (x, y, z, yaw).
  const auto segments = static_cast<Eigen::Index>(waypoints.size() - 1);
  constexpr auto kN = static_cast<Eigen::Index>(kCoefficients);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(kN * segments, kN * segments), b = Eigen::MatrixXd::Zero(kN * segments, 4);
  const auto duration = [&](Eigen::Index s) {
    return waypoints[static_cast<std::size_t>(s) + 1].time_s - waypoints[static_cast<std::size_t>(s)].time_s;
  };
  Eigen::Index row = 0;
  // d^n/dt^n at τ = 0 or 1, in 1/s^n.
  const auto add = [&](Eigen::Index s, std::size_t n, bool at_end, double sign) {
    double scale = sign;
    for (std::size_t i = 0; i < n; ++i) scale /= duration(s);
    for (std::size_t k = n; k < (at_end ? kCoefficients : n + 1); ++k)
      A(row, kN * s + static_cast<Eigen::Index>(k)) = scale * falling(k, n);
  };
  for (Eigen::Index s = 0; s < segments; ++s)
    for (const bool at_end : {false, true}) {
      add(s, 0, at_end, 1.0);
      const Waypoint& w = waypoints[static_cast<std::size_t>(s) + (at_end ? 1 : 0)];
      b.row(row++) << w.p_W_m.x(), w.p_W_m.y(), w.p_W_m.z(), w.yaw_rad;
    }
  for (std::size_t n = 1; n <= 3; ++n) {
    add(0, n, false, 1.0);
    ++row;
    add(segments - 1, n, true, 1.0);
    ++row;
  }
  for (Eigen::Index s = 0; s + 1 < segments; ++s)
    for (std::size_t n = 1; n <= 6; ++n) {
      add(s, n, true, 1.0);
      add(s + 1, n, false, -1.0);
      ++row;
    }
  const Eigen::MatrixXd solution = A.fullPivLu().solve(b);

  std::vector<Segment> out;
  for (Eigen::Index s = 0; s < segments; ++s) {
    Segment segment;
    segment.duration_s = duration(s);
    const std::array<Polynomial*, 4> channel{&segment.x_m, &segment.y_m, &segment.z_m, &segment.yaw_rad};
    for (Eigen::Index c = 0; c < 4; ++c) {
      std::array<double, kCoefficients> values{};
      for (std::size_t k = 0; k < kCoefficients; ++k) values[k] = solution(kN * s + static_cast<Eigen::Index>(k), c);
      *channel[static_cast<std::size_t>(c)] = in_seconds(values, segment.duration_s);
    }
    out.push_back(segment);
  }
  return out;
}

Trajectory join(const std::vector<Segment>& segments) {
  if (segments.empty() || segments.size() > kMaxSegments)
    throw Error({"", fmt::format("{} segments, expected 1 to {}", segments.size(), kMaxSegments), "", "shorten the flight"});
  Trajectory out;
  for (const Segment& s : segments) out.segments[out.count++] = s;
  return out;
}

TrajectoryFile slowed(const TrajectoryFile& file, double factor) {
  if (!(factor >= 1.0 && factor <= 100.0))
    throw Error({file.name, fmt::format("slowed down {} times, allowed is 1 to 100", factor), "", "give a time factor of 1 or more"});
  TrajectoryFile out = file;
  for (std::size_t k = 0; k < out.trajectory.count; ++k) {
    Segment& s = out.trajectory.segments[k];
    s.duration_s *= factor;
    for (Polynomial* p : {&s.x_m, &s.y_m, &s.z_m, &s.yaw_rad}) {
      double power = 1.0;
      for (double& c : p->c) {
        c /= power;
        power *= factor;
      }
    }
  }
  return out;
}

double slowing(const Trajectory& trajectory, const TrajectoryLimits& limits) {
  constexpr double kDecimals = 1.0001;  // a flight that was slowed down to a limit before is not slowed down again for its decimals
  if (!(limits.thrust_weight > 1.0) || !(limits.speed_m_s > 0.0) || !(limits.tilt_rad > 0.0))
    throw Error({"",
                 fmt::format("limits of {} m/s, {} times the weight and {} rad of tilt: no flight keeps them", limits.speed_m_s,
                             limits.thrust_weight, limits.tilt_rad),
                 "", "give a speed above 0, a thrust above the weight and a tilt above 0"});
  const auto keeps = [&](double factor, double slack = 1.0) {
    const Peaks p = peaks(slowed({"", trajectory}, factor).trajectory, 2e-3 * factor);
    return p.speed_m_s <= slack * limits.speed_m_s && p.thrust_weight_max <= slack * limits.thrust_weight &&
           p.tilt_rad <= slack * limits.tilt_rad;
  };
  if (keeps(1.0, kDecimals)) return 1.0;
  double low = 1.0, high = 2.0;
  while (!keeps(high)) {
    low = high;
    high *= 2.0;
    if (high > 100.0)
      throw Error({"", fmt::format("slowed down {} times the flight is still beyond its limits", low), "", "raise the limits"});
  }
  for (int k = 0; k < 30; ++k) (keeps(0.5 * (low + high)) ? high : low) = 0.5 * (low + high);
  return high;
}

Peaks peaks(const Trajectory& trajectory, double step_s) {
  Peaks out;
  Heading heading;
  const auto larger = [](double& peak, double value) { peak = std::max(peak, std::fabs(value)); };
  const auto steps = static_cast<int>(std::floor(trajectory.duration_s() / step_s));
  for (int i = 0; i <= steps; ++i) {
    const Setpoint s = trajectory.at(step_s * i);
    const Eigen::Vector3d thrust = s.a_W_m_s2 + Eigen::Vector3d(0.0, 0.0, kGravity_m_s2);
    const AttitudeSetpoint attitude = flat_attitude(thrust, s.j_W_m_s3, s.yaw_rad, s.yaw_rate_rad_s, heading);
    larger(out.speed_m_s, s.v_W_m_s.norm());
    larger(out.speed_xy_m_s, s.v_W_m_s.head<2>().norm());
    larger(out.speed_z_m_s, s.v_W_m_s.z());
    larger(out.accel_m_s2, s.a_W_m_s2.norm());
    larger(out.tilt_rad, acos_exact(std::clamp(attitude.R_WB(2, 2), -1.0, 1.0)));
    larger(out.roll_rate_rad_s, attitude.w_B_rad_s.x());
    larger(out.pitch_rate_rad_s, attitude.w_B_rad_s.y());
    larger(out.yaw_rate_rad_s, s.yaw_rate_rad_s);
    larger(out.yaw_accel_rad_s2, s.yaw_accel_rad_s2);
    out.thrust_weight_min = std::min(out.thrust_weight_min, thrust.norm() / kGravity_m_s2);
    out.thrust_weight_max = std::max(out.thrust_weight_max, thrust.norm() / kGravity_m_s2);
  }
  return out;
}

}  // namespace rotorloop::host
