// The three flights of scenarios/diagnose.toml, 20 s each: one minute that excites whatever the catalogue of effects knows, so that one
// and the same set of flights serves every diagnosis. The first stays between a ground at z = 0 and a ceiling at z = 3 m; the other two
// fly above such a roof, where neither is felt.
#include <numbers>

#include "host/control/sway.hpp"
#include "host/control/trajectory_generator.hpp"

namespace rotorloop::host {

namespace {

constexpr double kQuarter_rad = 0.5 * std::numbers::pi, kEighth_rad = 0.25 * std::numbers::pi;

// A flight from stop to stop: each leg says where it ends, how long it takes and how long to stay there.
class Legs {
 public:
  Legs(const Eigen::Vector3d& p_W_m, double hover_s) : at_{.p_W_m = p_W_m} { stay(hover_s); }
  Legs& to(const Eigen::Vector3d& p_W_m, double yaw_rad, double time_s, double stay_s = 0.0) {
    const Waypoint next{.p_W_m = p_W_m, .yaw_rad = yaw_rad, .time_s = time_s};
    segments_.push_back(rest_to_rest(at_, next));
    at_ = {.p_W_m = p_W_m, .yaw_rad = yaw_rad};
    return stay_s > 0.0 ? stay(stay_s) : *this;
  }
  Legs& turn(double yaw_rad, double time_s) { return to(at_.p_W_m, yaw_rad, time_s); }
  Legs& stay(double time_s) {
    segments_.push_back(hover(at_.p_W_m, at_.yaw_rad, time_s));
    return *this;
  }
  Legs& add(const std::vector<Segment>& more) {
    segments_.insert(segments_.end(), more.begin(), more.end());
    return *this;
  }
  TrajectoryFile file(const char* name) const { return {name, join(segments_)}; }

 private:
  Waypoint at_;
  std::vector<Segment> segments_;
};

}  // namespace

TrajectoryFile diagnose_vertical() {
  // Still beside the ground and below the ceiling; runs of three speeds, and a full turn of the heading spread over them: what stays
  // with the world is then separated from what turns with the body.
  const auto z = [](double z_m) { return Eigen::Vector3d(0.0, 0.0, z_m); };
  return Legs(z(1.0), 1.5)
      .to(z(0.14), 0.0, 1.0, 0.8)
      .to(z(0.22), 0.0, 0.5, 0.6)
      .to(z(0.40), 0.0, 0.5, 0.5)
      .to(z(2.90), 0.0, 1.8, 0.8)
      .to(z(2.80), 0.0, 0.5, 0.5)
      .to(z(0.50), kQuarter_rad, 1.5)
      .to(z(2.50), 2.0 * kQuarter_rad, 1.4)
      .to(z(0.50), 3.0 * kQuarter_rad, 1.4)
      .to(z(2.50), 4.0 * kQuarter_rad, 2.2)
      .to(z(0.50), 4.0 * kQuarter_rad, 2.2)
      .to(z(1.00), 4.0 * kQuarter_rad, 1.0, 0.8)
      .file("diagnosis, vertical, 3.3 m/s between 0.14 m and 2.9 m");
}

TrajectoryFile diagnose_horizontal() {
  // Passes out and back along x, y and the diagonal, at three speeds, nose first, sideways, backwards and with two rotors in line,
  // level, climbing and sinking, with brisk and gentle changes of speed: at equal speed the rotors then carry different loads.
  const auto at = [](double x_m, double y_m, double z_m) { return Eigen::Vector3d(x_m, y_m, z_m); };
  return Legs(at(0.0, 0.0, 4.0), 1.0)
      .to(at(11.0, 0.0, 4.0), 0.0, 2.6)
      .turn(kEighth_rad, 0.6)
      .to(at(0.0, 0.0, 7.0), kEighth_rad, 2.8)
      .turn(2.0 * kEighth_rad, 0.6)
      .to(at(0.0, 6.0, 7.0), 2.0 * kEighth_rad, 3.0)
      .to(at(0.0, 0.0, 4.0), 4.0 * kEighth_rad, 2.2)
      .to(at(6.0, 6.0, 5.0), 4.0 * kEighth_rad, 2.3)
      .turn(2.0 * kEighth_rad, 0.6)
      .to(at(0.0, 0.0, 4.0), 2.0 * kEighth_rad, 2.6, 1.7)
      .file("diagnosis, horizontal, 9.3 m/s along x, y and the diagonal");
}

TrajectoryFile diagnose_rotation() {
  // All three axes at once while it climbs, then straight down into its own wake.
  constexpr double kShake_s = 13.5, kClimb_m = 10.0, kStart_m = 4.0, kFall_s = 3.75;
  std::vector<Waypoint> path = sway({.span_s = kShake_s,
                                     .ramp_s = 1.5,
                                     .pieces = 76,
                                     .heave_m = 0.10,
                                     .x = {4.5, 8.5},
                                     .y = {8.5, 5.0},
                                     .z = {4.0, 6.5},
                                     .yaw = {0.9, 2.6},
                                     .roll_pitch_rate_rad_s = 5.0,
                                     .yaw_rate_rad_s = 4.5});
  for (Waypoint& w : path) {
    const double s = w.time_s / kShake_s;  // rises like the septic of rest_to_rest
    w.p_W_m.z() += kStart_m + kClimb_m * s * s * s * s * (35.0 + s * (-84.0 + s * (70.0 - 20.0 * s)));
  }
  const Eigen::Vector3d low_W_m{0.0, 0.0, kStart_m}, high_W_m{0.0, 0.0, kStart_m + kClimb_m};
  std::vector<Segment> segments{hover(low_W_m, 0.0, 1.0)};
  for (const Segment& s : through(path)) segments.push_back(s);
  segments.push_back(hover(high_W_m, 0.0, 0.75));
  segments.push_back(rest_to_rest({.p_W_m = high_W_m}, {.p_W_m = low_W_m, .time_s = kFall_s}));
  segments.push_back(hover(low_W_m, 0.0, 1.0));
  return {"diagnosis, about three axes at 5 rad/s while climbing, then down at 5.8 m/s", join(segments)};
}

}  // namespace rotorloop::host
