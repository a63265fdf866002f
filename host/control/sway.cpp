#include "host/control/sway.hpp"

#include <algorithm>

#include "host/base/elementary.hpp"

namespace rotorloop::host {

std::vector<Waypoint> sway(const Sway& wanted) {
  const auto sweep = [&](double t, const Sweep& band) {
    return sin_exact((band.from_rad_s + 0.5 * (band.to_rad_s - band.from_rad_s) * t / wanted.span_s) * t);
  };
  const auto ramp = [](double tau) {
    const double s = std::clamp(tau, 0.0, 1.0);
    return s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
  };
  std::vector<Waypoint> path;
  for (std::size_t i = 0; i <= wanted.pieces; ++i) {
    const double t = wanted.span_s * static_cast<double>(i) / static_cast<double>(wanted.pieces);
    const double share = ramp(t / wanted.ramp_s) * ramp((wanted.span_s - t) / wanted.ramp_s);
    path.push_back({.p_W_m = share * Eigen::Vector3d(wanted.sway_m * sweep(t, wanted.x), wanted.sway_m * sweep(t, wanted.y),
                                                     wanted.heave_m * sweep(t, wanted.z)),
                    .yaw_rad = share * wanted.turn_rad * sweep(t, wanted.yaw),
                    .time_s = t});
  }
  // Yaw first: it turns the sway into other body rates. Then the sway, whose rates grow with it but not in proportion.
  const Peaks raw = peaks(join(through(path)));
  for (Waypoint& w : path) w.yaw_rad *= wanted.yaw_rate_rad_s / raw.yaw_rate_rad_s;
  for (int i = 0; i < 6; ++i) {
    const Peaks p = peaks(join(through(path)));
    const double scale = wanted.roll_pitch_rate_rad_s / std::max(p.roll_rate_rad_s, p.pitch_rate_rad_s);
    for (Waypoint& w : path) w.p_W_m.head<2>() *= scale;
  }
  return path;
}

}  // namespace rotorloop::host
