#include "bench/sysid/diagnose/manoeuvre/manoeuvre_flight.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "bench/sysid/estimate/flight_motion.hpp"
#include "bench/sysid/estimate/mean_noise.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/base/constants.hpp"
#include "host/base/statistics.hpp"
#include "host/effects/term_size.hpp"

namespace rotorloop::diagnose {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double kNode_s = 2e-2;      // of the simulated flight, at least: its information hardly depends on it
constexpr double kSample_s = 1e-2;    // of the path, at most: what it asks for is below 3 Hz
constexpr double kThrustRatio = 2.0;  // thrust over weight that a multirotor has at least
constexpr double kSpare = 1.1;        // over the highest rotor speed that was flown
constexpr double kClear_m = 0.75;     // of the reference quadrotor: 12 rotor radii, where ground and ceiling are not felt
constexpr double kSmallRoom_m = 3.0;  // of the reference quadrotor: room that is always there
constexpr double kShares[] = {1.0, 0.8, 0.64, 0.5, 0.4, 0.33};
constexpr std::size_t kMargin = 4;  // samples on either side, for differences
constexpr int kPasses = 3;          // attitude and in-plane force follow from each other

// Measurements of one kind on a grid of wider steps: one in so many nodes, with the noise that what falls together on a node has in the
// mean.
struct Measurements {
  std::size_t every = 0;  // 0: none
  double noise = 1.0;     // of a single measurement's
};
Measurements thinned(const estimate::GridFlight& like, std::size_t measurements, std::size_t wider) {
  if (measurements == 0) return {};
  const double nodes =
      static_cast<double>(like.nodes) / (static_cast<double>(measurements) * static_cast<double>(wider));  // for each measurement
  return nodes >= 1.0 ? Measurements{static_cast<std::size_t>(std::lround(nodes)), 1.0} : Measurements{1, std::sqrt(nodes)};
}

// z axis along `up`, x axis as near to the heading as that allows.
Eigen::Quaterniond attitude(const Vector3d& up, double yaw_rad) {
  const Vector3d z = up.normalized(), y = z.cross(Vector3d(std::cos(yaw_rad), std::sin(yaw_rad), 0.0)).normalized();
  Eigen::Matrix3d r;
  r << y.cross(z), y, z;
  return Eigen::Quaterniond(r);
}

// Change of upward specific force and angular acceleration per change of each squared rotor speed, in hover.
Eigen::Matrix4d hover_slopes(const ManoeuvreSetting& s, const estimate::ModelValues& v, const estimate::Model& model) {
  estimate::RotorInputSample u;
  u.omega_rad_s.fill(s.rotor_rad_s);
  u.battery_V = identify::mean_battery_V(*s.like);
  estimate::BodyState still;
  still.p_W_m.z() = s.middle_z_m;
  const double lift = model.instant(still, u, 0.0).force_B_N.z() / (4.0 * s.rotor_rad_s * s.rotor_rad_s);
  Eigen::Matrix4d out;
  const Eigen::Matrix3d inverse_inertia = v.inertia_kg_m2().inverse();
  for (std::size_t r = 0; r < host::kRotors; ++r) {
    const host::RotorMount& rotor = v.geometry.rotors[r];
    const auto i = static_cast<Eigen::Index>(r);
    out(0, i) = lift / v[estimate::kMass];
    out.col(i).tail<3>() =
        inverse_inertia * Vector3d(lift * (rotor.position_m.y() - v[estimate::kComY]), -lift * (rotor.position_m.x() - v[estimate::kComX]),
                                   rotor.reaction * v[estimate::kCq]);
  }
  return out;
}

// States and rotor speeds along a path.
struct Flown {
  std::vector<estimate::BodyState> states;
  std::vector<log::RotorValues> omega;
};

// Inverse dynamics along a path: attitude and rotor speeds that give the acceleration which the path needs, by fixed-point passes.
class InverseDynamics {
 public:
  InverseDynamics(const std::vector<PathPoint>& path, double h, const ManoeuvreSetting& s, const estimate::ModelValues& v)
      : path_(path),
        h_(h),
        model_(v),
        inverse_slopes_(hover_slopes(s, v, model_).inverse()),
        battery_V_(identify::mean_battery_V(*s.like)),
        least_(std::pow(0.2 * s.rotor_rad_s, 2)),
        most_(s.most_rad_s * s.most_rad_s),
        flown_{std::vector<estimate::BodyState>(path.size()), std::vector<log::RotorValues>(path.size())},
        needed_(path.size()),
        in_plane_(path.size(), Vector3d::Zero()),
        turning_(path.size(), Vector3d::Zero()) {
    for (log::RotorValues& w : flown_.omega) w.fill(s.rotor_rad_s);
    const Vector3d gravity = kGravity_m_s2 * Vector3d(v[estimate::kTiltX], v[estimate::kTiltY], -1.0);
    const std::size_t n = path.size();
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t a = k > 0 ? k - 1 : 0, b = std::min(k + 1, n - 1);
      flown_.states[k].p_W_m = path[k].p_m;
      flown_.states[k].v_W_m_s = (path[b].p_m - path[a].p_m) / (static_cast<double>(b - a) * h);
      needed_[k] = -gravity;
      if (k > 0 && k + 1 < n) needed_[k] += (path[b].p_m - 2.0 * path[k].p_m + path[a].p_m) / (h * h);
    }
  }
  // Nothing where the path asks for free fall or for more than the rotors give.
  std::optional<Flown> solve() {
    for (int pass = 0; pass < kPasses; ++pass) {
      if (!turn() || !balance(pass)) return std::nullopt;
    }
    return std::move(flown_);
  }

 private:
  bool turn();
  bool balance(int pass);
  bool settle_rotors(std::size_t k, estimate::RotorInputSample& u);

  const std::vector<PathPoint>& path_;
  double h_;
  estimate::Model model_;
  Eigen::Matrix4d inverse_slopes_;
  double battery_V_, least_, most_;  // of the squared rotor speed
  Flown flown_;
  std::vector<Vector3d> needed_, in_plane_;  // specific force: W, as the path needs it; B, the part that thrust cannot give
  std::vector<Vector3d> turning_;            // angular acceleration, B
};

// Attitudes that point the thrust at what is needed, and the rates and angular accelerations that follow from them.
bool InverseDynamics::turn() {
  std::vector<estimate::BodyState>& x = flown_.states;
  const std::size_t n = x.size();
  for (std::size_t k = 0; k < n; ++k) {
    const Vector3d up = needed_[k] - x[k].q_WB * in_plane_[k];
    if (up.norm() < 1.0) return false;  // free fall: the attitude means nothing
    x[k].q_WB = attitude(up, path_[k].yaw_rad);
  }
  for (std::size_t k = 1; k + 1 < n; ++k) x[k].w_B_rad_s = estimate::log_q(x[k - 1].q_WB.conjugate() * x[k + 1].q_WB) / (2.0 * h_);
  for (std::size_t k = 2; k + 2 < n; ++k) turning_[k] = (x[k + 1].w_B_rad_s - x[k - 1].w_B_rad_s) / (2.0 * h_);
  return true;
}

// Rotor speeds that balance force and moment at every sample; the margins hold what stands next to them.
bool InverseDynamics::balance(int pass) {
  const std::size_t n = flown_.states.size();
  const std::vector<log::RotorValues> before = flown_.omega;
  for (std::size_t k = kMargin; k + kMargin < n; ++k) {
    estimate::RotorInputSample u;
    u.battery_V = battery_V_;
    u.omega_rad_s = pass == 0 ? flown_.omega[k - 1] : before[k];
    if (pass > 0) {
      for (std::size_t r = 0; r < host::kRotors; ++r) u.omega_dot_rad_s2[r] = (before[k + 1][r] - before[k - 1][r]) / (2.0 * h_);
    }
    if (!settle_rotors(k, u)) return false;
    flown_.omega[k] = u.omega_rad_s;
  }
  for (std::size_t k = 0; k < kMargin; ++k) {
    const std::size_t last = n - 1 - kMargin;
    flown_.omega[k] = flown_.omega[kMargin];
    flown_.omega[n - 1 - k] = flown_.omega[last];
    in_plane_[k] = in_plane_[kMargin];
    in_plane_[n - 1 - k] = in_plane_[last];
  }
  return true;
}

// False: a rotor at its limit, or no balance.
bool InverseDynamics::settle_rotors(std::size_t k, estimate::RotorInputSample& u) {
  const estimate::BodyState& x = flown_.states[k];
  for (int tries = 0; tries < 25; ++tries) {
    const estimate::Instant now = model_.instant(x, u, static_cast<double>(k) * h_);
    if (now.beyond_equations || !now.specific_force_B_m_s2.allFinite()) return false;
    in_plane_[k] = {now.specific_force_B_m_s2.x(), now.specific_force_B_m_s2.y(), 0.0};
    Vector4d miss;
    miss << (x.q_WB.conjugate() * needed_[k]).z() - now.specific_force_B_m_s2.z(), turning_[k] - now.angular_acceleration_B_rad_s2;
    if (std::fabs(miss[0]) < 1e-2 && miss.tail<3>().norm() < 0.1) return true;
    const Vector4d step = inverse_slopes_ * miss;
    for (std::size_t r = 0; r < host::kRotors; ++r) {
      const double square = u.omega_rad_s[r] * u.omega_rad_s[r] + step[static_cast<Eigen::Index>(r)];
      u.omega_rad_s[r] = std::sqrt(std::clamp(square, least_, most_));
    }
  }
  return false;
}

// Rotor speeds as the logs hold them: measured, or as the command that makes a first-order motor turn so.
log::FlightRecord record_of(const Flown& f, double h, const ManoeuvreSetting& s, const estimate::ModelValues& v) {
  log::FlightRecord out;
  const double battery_V = identify::mean_battery_V(*s.like);
  for (std::size_t k = 0; k < f.omega.size(); ++k) {
    const double t = (static_cast<double>(k) - static_cast<double>(kMargin)) * h;
    if (battery_V > 0.0) out.battery_V.add(t, battery_V);
    if (!s.like->input.from_commands()) {
      out.rotor_omega_rad_s.add(t + v[estimate::kRotorDelay], f.omega[k]);
      continue;
    }
    const double full = v.reference_V > 0.0 && battery_V > 0.0 ? std::pow(battery_V / v.reference_V, v[estimate::kVoltageExponent]) : 1.0;
    const std::size_t a = k > 0 ? k - 1 : 0, b = std::min(k + 1, f.omega.size() - 1);
    log::RotorValues command{};
    for (std::size_t r = 0; r < host::kRotors; ++r) {
      const double rate = (f.omega[b][r] - f.omega[a][r]) / (static_cast<double>(b - a) * h);
      command[r] = ((f.omega[k][r] + v[estimate::kCommandLag] * rate) / full - v[estimate::kCommandOffset]) / v[estimate::kCommandGain];
    }
    out.motor_command.add(t, command);
  }
  return out;
}

// Moves a path in free air to where the flights were, clear of ground and ceiling; the others onto theirs.
void place(std::vector<PathPoint>& path, Level level, const ManoeuvreSetting& s) {
  const host::LoadGeometry& g = s.values.geometry;
  double low = path.front().p_m.z(), high = low;
  for (const PathPoint& p : path) {
    low = std::min(low, p.p_m.z());
    high = std::max(high, p.p_m.z());
  }
  double lift = 0.0;
  if (level == Level::ground) {
    lift = g.ground_z_m;
  } else if (level == Level::ceiling) {
    for (PathPoint& p : path) p.p_m.z() = g.ceiling_z_m - p.p_m.z();
  } else {
    const double clear = kClear_m * s.length_ratio;
    lift = std::max(s.middle_z_m - 0.5 * (low + high), g.ground_z_m + clear - low);
    if (high + lift > g.ceiling_z_m - clear && low + lift < g.ceiling_z_m + clear) lift = g.ceiling_z_m + clear - low;
  }
  for (PathPoint& p : path) p.p_m.z() += lift;
}

// Largest way of a path, level and upright.
std::array<double, 2> extent(const std::vector<PathPoint>& path) {
  Vector3d low = path.front().p_m, high = low;
  for (const PathPoint& p : path) {
    low = low.cwiseMin(p.p_m);
    high = high.cwiseMax(p.p_m);
  }
  return {(high - low).head<2>().norm(), (high - low).z()};
}

}  // namespace

ManoeuvreSetting manoeuvre_setting(const identify::Identification& r) {
  const auto& flights = r.problem.flights;
  ManoeuvreSetting out{.values = r.fit.values.front(), .noise = estimate::mean_noise(r.fit.noise), .like = flights.front()};
  for (std::size_t k = 0; k < out.values.terms.parameters(); ++k) {
    if (out.values.terms.is_start(k)) out.values[estimate::kCoreParameters + static_cast<int>(k)] = 0.0;
  }
  out.length_ratio = host::arm_m(out.values.geometry) / host::kReferenceArm_m;
  double sum = 0.0, count = 0.0, highest = 0.0;
  std::vector<double> heights;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    estimate::RotorInput input = flights[f]->input;
    input.prepare(r.fit.values[f]);
    std::size_t hint = 0;
    Vector3d low = Vector3d::Constant(1e300), high = -low;
    for (std::size_t k = 0; k < flights[f]->nodes; ++k) {
      if (!flights[f]->tied(k)) continue;
      for (const double w : input.at(flights[f]->time_s(k), hint, false).omega_rad_s) {
        sum += w * w;
        count += 1.0;
        highest = std::max(highest, w);
      }
      low = low.cwiseMin(r.fit.states[f][k].p_W_m);
      high = high.cwiseMax(r.fit.states[f][k].p_W_m);
      heights.push_back(r.fit.states[f][k].p_W_m.z());
    }
    out.way_m = std::max(out.way_m, (high - low).head<2>().norm());
    out.height_m = std::max(out.height_m, (high - low).z());
  }
  out.rotor_rad_s = std::sqrt(sum / count);  // thrust follows the square: this carries the weight
  out.most_rad_s = std::max(kSpare * highest, std::sqrt(kThrustRatio) * out.rotor_rad_s);
  out.way_m = std::max(out.way_m, kSmallRoom_m * out.length_ratio);
  out.height_m = std::max(out.height_m, kSmallRoom_m * out.length_ratio);
  out.middle_z_m = median(std::move(heights));
  return out;
}

namespace {

// Times of a manoeuvre's flight: steps of the fit, and the finer samples that it is flown with.
struct Timing {
  std::size_t wider = 1, per_step = 1;  // steps of the flights to one of this; samples to a step
  double step_s = 0.0, sample_s = 0.0;
  std::size_t nodes = 0, samples = 0;
  Timing(const estimate::GridFlight& like, double duration_s) {
    wider = static_cast<std::size_t>(std::max(1.0, std::floor(kNode_s / like.step_s + 1e-9)));
    step_s = static_cast<double>(wider) * like.step_s;
    per_step = static_cast<std::size_t>(std::max(1.0, std::ceil(step_s / kSample_s - 1e-9)));
    sample_s = step_s / static_cast<double>(per_step);
    nodes = static_cast<std::size_t>(std::lround(duration_s / step_s)) + 1;
    samples = (nodes - 1) * per_step + 1;
  }
};

// Measurements as often as the flights have them, as the model says and without noise: only how they depend on states and parameters
// counts.
void add_flown_measurements(const Flown& f, const Timing& t, const estimate::GridFlight& like, ManoeuvreFlight& out) {
  estimate::GridFlight& g = out.flight;
  const estimate::ModelValues& values = out.values;
  const Vector3d lever(values[estimate::kOffsetX], values[estimate::kOffsetY], values[estimate::kOffsetZ]);
  const Measurements pose = thinned(like, like.pose.size(), t.wider), position = thinned(like, like.position.size(), t.wider),
                     velocity = thinned(like, like.velocity.size(), t.wider), gyro = thinned(like, like.gyro.size(), t.wider),
                     accel = thinned(like, like.accel.size(), t.wider);
  out.noise.position_m *= pose.every ? pose.noise : position.noise;
  out.noise.attitude_rad *= pose.noise;
  out.noise.velocity_m_s *= velocity.noise;
  out.noise.gyro_rad_s *= gyro.noise;
  out.noise.accel_m_s2 *= accel.noise;
  const auto due = [](const Measurements& r, std::size_t k) { return r.every > 0 && k % r.every == 0; };
  for (std::size_t k = 0; k < t.nodes; ++k) {
    const estimate::BodyState& x = f.states[kMargin + k * t.per_step];
    out.states.push_back(x);
    const Vector3d at = x.p_W_m + x.q_WB * lever;
    if (due(pose, k)) g.pose.push_back({k, values[estimate::kPoseDelay], {at, x.q_WB * values.q_BS()}});
    if (due(position, k)) g.position.push_back({k, values[estimate::kPoseDelay], at});
    if (due(velocity, k)) g.velocity.push_back({k, 0.0, x.v_W_m_s + x.q_WB * x.w_B_rad_s.cross(lever)});
    if (due(gyro, k)) g.gyro.push_back({k, 0.0, x.w_B_rad_s});
    if (due(accel, k)) g.accel.push_back({k, 0.0, Vector3d::Zero()});
  }
}

}  // namespace

std::optional<ManoeuvreFlight> flown(const Manoeuvre& m, const ManoeuvreSetting& s, double duration_s) {
  if (m.level == Level::ceiling && !std::isfinite(s.values.geometry.ceiling_z_m)) return std::nullopt;
  estimate::ModelValues values = s.values;
  values[estimate::kMass] *= 1.0 + m.payload_share;
  values.geometry.mass_kg *= 1.0 + m.payload_share;
  const Timing t(*s.like, duration_s);
  for (const double share : kShares) {
    std::vector<PathPoint> path;
    for (std::size_t k = 0; k < t.samples + 2 * kMargin; ++k)
      path.push_back(path_point(m, (static_cast<double>(k) - static_cast<double>(kMargin)) * t.sample_s, s.length_ratio, share));
    const auto [way, height] = extent(path);
    if (way > 1.01 * s.way_m || (m.level == Level::free_air && height > 1.01 * s.height_m)) continue;
    place(path, m.level, s);
    const std::optional<Flown> f = InverseDynamics(path, t.sample_s, s, values).solve();
    if (!f) continue;

    ManoeuvreFlight out{.flight = {.name = m.id,
                                   .linked = {},
                                   .pose = {},
                                   .position = {},
                                   .velocity = {},
                                   .gyro = {},
                                   .accel = {},
                                   .load_W_m = {},
                                   .input = estimate::RotorInput(record_of(*f, t.sample_s, s, values))},
                        .states = {},
                        .values = values,
                        .noise = s.noise,
                        .share = share};
    estimate::GridFlight& g = out.flight;
    g.step_s = t.step_s;
    g.nodes = t.nodes;
    g.substeps = 1;
    g.slopes_by_middle = s.like->slopes_by_middle;
    g.linked.assign(t.nodes - 1, 1);
    g.anchor = s.like->anchor;
    add_flown_measurements(*f, t, *s.like, out);
    if (values.terms.memory() > 0) estimate::follow_states({&g, 1}, {&out.states, 1});
    return out;
  }
  return std::nullopt;
}

}  // namespace rotorloop::diagnose
