// Attitude, gyro and accelerometer agree on one rotation and one gravity, in one unit and one frame, or the log is refused with the
// reading that would make them agree. No fitted parameter is needed: the rate of the attitude *is* what the gyro measures.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/sysid/log/check/check_steps.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::log {
namespace {

constexpr double kInertialCorner_hz = 6.0;

// Σ gyro_i rate_j over the valid points, and both energies. Agreement = energy-weighted correlation of all three axes together.
struct Agreement {
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();  // row: gyro axis; column: axis of the attitude's rate
  Eigen::Vector3d gyro2 = Eigen::Vector3d::Zero(), rate2 = Eigen::Vector3d::Zero();
  std::size_t points = 0;
  double total() const { return cross.trace() / std::sqrt(gyro2.sum() * rate2.sum() + 1e-30); }
  double axis(int i) const { return cross(i, i) / std::sqrt(gyro2[i] * rate2[i] + 1e-30); }
  double gain() const { return std::sqrt(gyro2.sum() / (rate2.sum() + 1e-30)); }
};

// The best of the lags: a late pose must not pass for a wrong axis.
Agreement agreement(const FlightGrid& g, const std::vector<Eigen::Vector3d>& rate, double longest_lag_s) {
  Eigen::Vector3d mean_gyro = Eigen::Vector3d::Zero(), mean_rate = Eigen::Vector3d::Zero();
  std::size_t n = 0;
  for (std::size_t i = 0; i < rate.size(); ++i)
    if (g.valid[i]) {
      mean_gyro += g.gyro_B_rad_s[i];
      mean_rate += rate[i];
      ++n;
    }
  if (n > 0) {
    mean_gyro /= static_cast<double>(n);
    mean_rate /= static_cast<double>(n);
  }
  Agreement best;
  const auto reach = static_cast<std::ptrdiff_t>(longest_lag_s / g.grid.dt_s);
  for (std::ptrdiff_t lag = -reach; lag <= reach; lag += 4) {
    Agreement a;
    for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, lag);
         i < static_cast<std::ptrdiff_t>(rate.size()) + std::min<std::ptrdiff_t>(0, lag); ++i) {
      const auto ig = static_cast<std::size_t>(i), ip = static_cast<std::size_t>(i - lag);
      if (!g.valid[ig] || !g.valid[ip]) continue;
      const Eigen::Vector3d w = g.gyro_B_rad_s[ig] - mean_gyro, r = rate[ip] - mean_rate;
      a.cross += w * r.transpose();
      a.gyro2 += w.cwiseAbs2();
      a.rate2 += r.cwiseAbs2();
      ++a.points;
    }
    if (a.cross.cwiseAbs().maxCoeff() > best.cross.cwiseAbs().maxCoeff()) best = a;
  }
  return best;
}

// What a quaternion column may have been meant as. Stored as (w, x, y, z) here.
struct QuaternionReading {
  const char* words;
  Eigen::Quaterniond (*read)(const Eigen::Quaterniond&);
};
using Q = Eigen::Quaterniond;
const std::array<QuaternionReading, 5> kReadings{{
    {"", [](const Q& q) { return q; }},
    {"the conjugate (world to body)", [](const Q& q) { return q.conjugate(); }},
    {"stored x, y, z, w and read as w, x, y, z", [](const Q& q) { return Q(q.z(), q.w(), q.x(), q.y()); }},
    {"stored w, x, y, z and read as x, y, z, w", [](const Q& q) { return Q(q.x(), q.y(), q.z(), q.w()); }},
    {"stored x, y, z, w, read as w, x, y, z, and the conjugate", [](const Q& q) { return Q(q.z(), -q.w(), -q.x(), -q.y()); }},
}};

// The signed permutation of the gyro's axes that fits best; +1…+3 and -1…-3 name what stands on x, y, z.
struct AxisReading {
  std::array<int, 3> axis{1, 2, 3};
  double agreement = -1.0;
  bool identity() const { return axis == std::array<int, 3>{1, 2, 3}; }
  bool mirrored() const {
    const bool odd =
        (std::abs(axis[0]) > std::abs(axis[1])) ^ (std::abs(axis[0]) > std::abs(axis[2])) ^ (std::abs(axis[1]) > std::abs(axis[2]));
    return odd != (axis[0] * axis[1] * axis[2] < 0);
  }
  std::string words() const {
    std::string s;
    for (const int a : axis) s += fmt::format("{}{}{}", s.empty() ? "" : ", ", a < 0 ? "-" : "", "xyz"[std::abs(a) - 1]);
    return s;
  }
};

AxisReading best_axes(const Agreement& a) {
  AxisReading best;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      AxisReading r;
      double sum = 0.0;
      for (std::size_t i = 0; i < 3; ++i) {
        const double s = (signs >> i) & 1 ? -1.0 : 1.0;
        sum += s * a.cross(static_cast<Eigen::Index>(i), order[i]);
        r.axis[i] = static_cast<int>(s) * (order[i] + 1);
      }
      r.agreement = sum / std::sqrt(a.gyro2.sum() * a.rate2.sum() + 1e-30);
      if (r.agreement > best.agreement + 1e-12) best = r;
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

// Rate in body axes of the attitude as `read` has it; the columns are of the sensor, hence the way there and back.
std::vector<Eigen::Vector3d> rate_of(const FlightGrid& g, const Q& q_BS, Q (*read)(const Q&)) {
  std::vector<Eigen::Vector3d> out(g.q_WB.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 1; i + 1 < out.size(); ++i) {
    const Q d_S = read(g.q_WB[i - 1] * q_BS).conjugate() * read(g.q_WB[i + 1] * q_BS);
    Q d = q_BS * d_S * q_BS.conjugate();
    if (d.w() < 0.0) d.coeffs() = -d.coeffs();
    out[i] = d.vec() / g.grid.dt_s;
  }
  return out;
}

void check_rates(CheckState& s, const FlightGrid& g) {
  constexpr double kAgree = 0.75, kDisagree = 0.5;
  constexpr double kLeastTurning_rad_s = 0.05;  // rms; below it a log of mocap noise says nothing
  const TimeRange all = s.span();
  const Agreement as_read = agreement(g, g.pose_rate_B_rad_s, s.limits.longest_lag_s);
  if (as_read.points < 100) return;
  const double rms = std::sqrt(std::min(as_read.rate2.sum(), as_read.gyro2.sum()) / static_cast<double>(as_read.points));
  if (rms < kLeastTurning_rad_s) return;
  bool flipped = false;
  for (int i = 0; i < 3; ++i) {
    const double axis_rms = std::sqrt(as_read.rate2[i] / static_cast<double>(as_read.points));
    flipped = flipped || (axis_rms > kLeastTurning_rad_s && as_read.axis(i) < -kDisagree);
  }
  if (as_read.total() >= kAgree && !flipped) {
    const double gain = as_read.gain();
    for (const auto& [factor, words, remedy] :
         {std::tuple{kDeg_per_rad, "the gyro is in deg/s, read as rad/s", "give the gyro's unit as deg/s"},
          std::tuple{1.0 / kDeg_per_rad, "the gyro is in rad/s, converted from deg/s once too often", "give the gyro's unit as rad/s"}})
      if (gain > 0.5 * factor && gain < 2.0 * factor)
        s.refuse(stream_name::gyro, fmt::format("shows {:.3g} times the rate of the attitude (allowed 0.67 to 1.5)", gain), all, words,
                 remedy);
    if (!s.refused() && (gain < 0.67 || gain > 1.5))
      s.note(stream_name::gyro, fmt::format("shows {:.3g} times the rate of the attitude; one of the two is scaled or smoothed", gain),
             all);
    return;
  }
  // Another reading of the quaternion, of the gyro's axes, or of both? The simplest that agrees well wins.
  const QuaternionReading* quaternion = nullptr;
  AxisReading axes;
  double best = 0.0;
  for (const QuaternionReading& reading : kReadings) {
    const Agreement a = agreement(g, rate_of(g, s.vehicle.pose_sensor_q_BS, reading.read), s.limits.longest_lag_s);
    const AxisReading x = best_axes(a);
    const double changes = (reading.words[0] != '\0' ? 1.0 : 0.0) + (x.identity() ? 0.0 : x.mirrored() ? 1.5 : 1.0);
    const double score = x.agreement - 0.1 * changes;
    if (quaternion && score <= best) continue;
    best = score;
    quaternion = &reading;
    axes = x;
  }
  const std::string found = fmt::format("rate of the attitude and gyro agree by {:.2f} (allowed {:.2f} to 1)", as_read.total(), kAgree);
  if (axes.agreement > 0.8 && (quaternion->words[0] != '\0' || !axes.identity())) {
    std::string likely, remedy;
    if (quaternion->words[0] != '\0') {
      likely = fmt::format("the quaternion is {}", quaternion->words);
      remedy = "name the columns of w, x, y, z and the direction in the mapping";
    }
    if (!axes.identity()) {
      likely += fmt::format("{}the gyro's x, y, z are {} of the attitude's body frame", likely.empty() ? "" : "; ", axes.words());
      remedy += fmt::format("{}give the gyro's axes or frame in the mapping", remedy.empty() ? "" : "; ");
    }
    s.refuse(stream_name::gyro, found + fmt::format("; {:.2f} when read as stated below", axes.agreement), all, likely, remedy);
  } else if (as_read.total() < kDisagree && rms > 0.3) {
    s.refuse(stream_name::gyro, found, all,
             "attitude and gyro of different vehicles, clocks apart by more than the search, or a frame that is no permutation of ours",
             "compare both by eye; give the time offset in the mapping");
  } else {
    s.note(stream_name::gyro, found + "; little turning or a noisy attitude", all);
  }
}

// The thrust axis points up in the mean of a flight. Where it points down while gyro and attitude turn alike, one of the two frames of
// the attitude is upside down: the accelerometer, which is in body axes, shows which.
void check_upright(CheckState& s, const FlightGrid& g) {
  constexpr double kUpsideDown = -0.5;
  double up = 0.0, felt = 0.0, n = 0.0;
  for (std::size_t i = 0; i < g.grid.count; ++i) {
    if (!g.valid[i]) continue;
    up += (g.q_WB[i] * Eigen::Vector3d::UnitZ()).z();
    if (g.has_accel) felt += g.accel_B_m_s2[i].z();
    n += 1.0;
  }
  if (n < 100.0 || up / n > kUpsideDown) return;
  const std::string what =
      fmt::format("z of the body points along {:+.2f} of the world's z in the mean (allowed {:.1f} to 1)", up / n, kUpsideDown);
  const std::string body = "body axes are forward-right-down", world = "world axes are north-east-down";
  const std::string set_body = "body = \"FRD\"", set_world = "world = \"NED\"";
  const std::string where = " in the mapping's [axes], or in each [[stream]] that has them";
  if (g.has_accel && felt < 0.0) {
    s.refuse(stream_name::pose, what, s.span(), body, "give " + set_body + where);
  } else if (g.has_accel) {
    s.refuse(stream_name::pose, what, s.span(), world, "give " + set_world + where);
  } else {
    s.refuse(stream_name::pose, what, s.span(), body + ", or " + world + ", or the quaternion is stored w, x, y, z and read as x, y, z, w",
             "give " + set_body + " or " + set_world + where + "; name the columns of w, x, y, z in this order");
  }
}

// Mean specific force in world axes is gravity, whatever was flown, when the flight begins and ends at moderate speed; without
// attitude the mean along body z must do.
void check_gravity(CheckState& s, const FlightGrid& g) {
  const TimeRange all = s.span();
  Eigen::Vector3d world = Eigen::Vector3d::Zero(), body = Eigen::Vector3d::Zero();
  std::size_t n = 0;
  for (std::size_t i = 0; i < g.grid.count; ++i) {
    if (!g.valid[i]) continue;
    body += g.accel_B_m_s2[i];
    if (g.has_attitude) world += g.q_WB[i] * g.accel_B_m_s2[i];
    ++n;
  }
  if (n < 100) return;
  world /= static_cast<double>(n);
  body /= static_cast<double>(n);
  const double shown = (g.has_attitude ? world.z() : body.z()) / kGravity_m_s2;
  const double low = g.has_attitude ? 0.75 : 0.5, high = g.has_attitude ? 1.33 : 3.0;
  if (shown >= low && shown <= high) return;
  const std::string what = fmt::format("mean specific force upwards is {:.4g} m/s^2 (allowed {:.3g} to {:.3g})", shown * kGravity_m_s2,
                                       low * kGravity_m_s2, high * kGravity_m_s2);
  const auto near = [&](double ratio) { return shown > 0.7 * ratio && shown < 1.4 * ratio; };
  if (near(1.0 / kGravity_m_s2)) {
    s.refuse(stream_name::accel, what, all, "the accelerometer is in g", "give its unit as g");
  } else if (near(1000.0 / kGravity_m_s2)) {
    s.refuse(stream_name::accel, what, all, "the accelerometer is in mg", "give its unit as mg");
  } else if (near(kGravity_m_s2)) {
    s.refuse(stream_name::accel, what, all, "an accelerometer in m/s^2, converted from g once too often", "give its unit as m/s^2");
  } else if (shown < -0.5 && shown > -2.0) {
    s.refuse(stream_name::accel, what, all,
             g.has_attitude ? "z points down in world and body both, or the sign of specific force is that of gravity"
                            : "z of the body points down, or the sign of specific force is that of gravity",
             g.has_attitude
                 ? "give world = \"NED\" and body = \"FRD\" in the mapping's [axes]; or sign = [-1, -1, -1] in the [[stream]] of accel"
                 : "give body = \"FRD\" in the mapping's [axes]; or sign = [-1, -1, -1] in the [[stream]] of accel");
  } else if (std::abs(shown) < 0.25) {
    s.refuse(stream_name::accel, what, all, "gravity was taken out of the accelerometer's values",
             "name acceleration as such, with gravity to be added");
  } else if (std::abs(shown) < 0.75 && g.has_attitude && std::abs(body.norm() / kGravity_m_s2 - 1.0) < 0.3) {
    s.refuse(stream_name::accel, what, all, "attitude and accelerometer are in different frames, or the quaternion's order is wrong",
             "name the columns of w, x, y, z and the frames in the mapping");
  } else {
    s.refuse(stream_name::accel, what, all, "a unit or scale that is none of g, mg, m/s^2", "give its unit");
  }
}

}  // namespace

void check_inertial(CheckState& s) {
  const FlightGrid g = make_grid(s, kInertialCorner_hz);
  if (g.has_gyro && g.has_attitude) check_rates(s, g);
  if (g.has_attitude && !s.refused()) check_upright(s, g);
  if (g.has_accel && !s.refused()) check_gravity(s, g);
}

}  // namespace rotorloop::log
