// How late each stream is against another, from what both must show: initial values for the fit's time offsets, and a fault when
// streams of one log do not keep one clock. The lag of largest correlation, between grid points by a parabola; its uncertainty
// from leaving out a tenth of the flight at a time, which counts coloured noise as what it is; for rotor speeds also from what of the
// airflow's part of the thrust is known, for that is where most of their error lies.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "bench/sysid/log/check/check_steps.hpp"
#include "bench/sysid/log/check/stream_access.hpp"
#include "host/base/constants.hpp"
#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::log {
namespace {

constexpr double kOffsetCorner_hz = 10.0;
constexpr double kClimbCorner_hz = 1.5;  // below it the climb speed, not the rotors, shapes the force
constexpr std::size_t kParts = 10;
// Of rotor speeds against force. Below it drag and inflow of the manoeuvre shape the force as much as the speeds do: 0.82 came with
// -36 ms where the true lag was below 0.3 ms.
constexpr double kLeastLiftCorrelation = 0.92;

using Channels = std::vector<std::vector<double>>;

Channels channels(const std::vector<Eigen::Vector3d>& v) {
  Channels c(3, std::vector<double>(v.size()));
  for (std::size_t i = 0; i < v.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) c[k][i] = v[i][static_cast<Eigen::Index>(k)];
  return c;
}

// Without what is slower than `corner_hz`: there every pair differs by bias, drift and drag.
void high_pass(Channels& c, double dt_s, double corner_hz) {
  for (auto& v : c) {
    const std::vector<double> slow = low_pass(v, dt_s, corner_hz);
    for (std::size_t i = 0; i < v.size(); ++i) v[i] -= slow[i];
  }
}

struct Sums {
  double xy = 0.0, xx = 0.0, yy = 0.0;
};

struct Peak {
  double lag_s = 0.0, correlation = -1.0;
  bool inside = false;  // not at the end of the search
};

Peak peak(const std::vector<Sums>& lags, double dt_s) {
  const auto rho = [&](std::size_t i) { return lags[i].xy / std::sqrt(lags[i].xx * lags[i].yy + 1e-30); };
  std::size_t best = 0;
  for (std::size_t i = 1; i < lags.size(); ++i)
    if (rho(i) > rho(best)) best = i;
  Peak p{.lag_s = 0.0, .correlation = rho(best), .inside = best > 0 && best + 1 < lags.size()};
  double shift = 0.0;
  if (p.inside) {
    const double a = rho(best - 1), b = rho(best), c = rho(best + 1);
    const double curve = a - 2.0 * b + c;
    if (curve < 0.0) shift = 0.5 * (a - c) / curve;
  }
  p.lag_s = (static_cast<double>(best) - 0.5 * static_cast<double>(lags.size() - 1) + shift) * dt_s;
  return p;
}

// Sums over the flight for lags from -reach to reach in steps of `step`, in ten parts.
std::vector<std::vector<Sums>> sums_of(const FlightGrid& g, const Channels& y, const Channels& x, std::ptrdiff_t reach,
                                       std::ptrdiff_t step) {
  const std::vector<char> valid = shrunk(g.valid, g.grid.dt_s, 0.1);
  const auto n = static_cast<std::ptrdiff_t>(g.grid.count);
  const std::size_t lags = static_cast<std::size_t>(2 * reach / step + 1);
  std::vector<std::vector<Sums>> part(kParts, std::vector<Sums>(lags));
  for (std::size_t k = 0; k < lags; ++k) {
    const std::ptrdiff_t lag = static_cast<std::ptrdiff_t>(k) * step - reach;
    for (std::ptrdiff_t i = reach; i < n - reach; i += 2) {  // the same samples of y at every lag
      const auto iy = static_cast<std::size_t>(i), ix = static_cast<std::size_t>(i - lag);
      if (!valid[iy] || !valid[ix]) continue;
      Sums& p = part[static_cast<std::size_t>(i) * kParts / static_cast<std::size_t>(n)][k];
      for (std::size_t c = 0; c < x.size(); ++c) {
        p.xy += x[c][ix] * y[c][iy];
        p.xx += x[c][ix] * x[c][ix];
        p.yy += y[c][iy] * y[c][iy];
      }
    }
  }
  return part;
}

std::vector<Sums> total(const std::vector<std::vector<Sums>>& part) {
  std::vector<Sums> all(part.front().size());
  for (const auto& p : part)
    for (std::size_t k = 0; k < all.size(); ++k) {
      all[k].xy += p[k].xy;
      all[k].xx += p[k].xx;
      all[k].yy += p[k].yy;
    }
  return all;
}

// Streams that agree nowhere within the search and well beyond it: no lag of a sensor, but stamps of another clock.
bool refuse_far_apart(CheckState& s, const FlightGrid& g, const char* y_name, const Channels& y, const char* x_name, const Channels& x) {
  constexpr double kFarthest_s = 1.0, kCertain = 0.9, kLeast_s = 10.0;  // two hops of a short flight look like one another
  constexpr std::ptrdiff_t kStep = 4;
  const auto reach = static_cast<std::ptrdiff_t>(kFarthest_s / g.grid.dt_s) / kStep * kStep;
  if (static_cast<double>(std::count(g.valid.begin(), g.valid.end(), char{1})) * g.grid.dt_s < kLeast_s) return false;
  const Peak far = peak(total(sums_of(g, y, x, reach, kStep)), g.grid.dt_s * static_cast<double>(kStep));
  if (!far.inside || far.correlation < kCertain || std::abs(far.lag_s) < s.limits.longest_lag_s) return false;
  s.refuse(y_name,
           fmt::format("stamps {:+.0f} ms late against {} (correlation {:.2f}; allowed -{:.0f} to {:.0f} ms)", 1e3 * far.lag_s, x_name,
                       far.correlation, 1e3 * s.limits.longest_lag_s, 1e3 * s.limits.longest_lag_s),
           s.span(), "stamps of arrival for stamps of measurement, or another clock",
           fmt::format("give time_offset_s = {:.2f} for this stream in the mapping, or log when it was measured", -far.lag_s));
  return true;
}

// y(t) ~ x(t - lag); nothing when this flight does not determine it.
std::optional<StreamOffset> estimate(CheckState& s, const FlightGrid& g, const char* y_name, Channels y, const char* x_name, Channels x,
                                     double high_pass_hz, double least_correlation = 0.6) {
  high_pass(x, g.grid.dt_s, high_pass_hz);
  high_pass(y, g.grid.dt_s, high_pass_hz);
  const auto part = sums_of(g, y, x, static_cast<std::ptrdiff_t>(s.limits.longest_lag_s / g.grid.dt_s), 1);
  const std::vector<Sums> all = total(part);
  const Peak whole = peak(all, g.grid.dt_s);
  if (!whole.inside || whole.correlation < least_correlation) {
    if (!s.refused()) refuse_far_apart(s, g, y_name, y, x_name, x);
    return std::nullopt;
  }
  std::vector<double> without;
  for (const auto& p : part) {
    std::vector<Sums> rest = all;
    for (std::size_t k = 0; k < rest.size(); ++k) {
      rest[k].xy -= p[k].xy;
      rest[k].xx -= p[k].xx;
      rest[k].yy -= p[k].yy;
    }
    without.push_back(peak(rest, g.grid.dt_s).lag_s);
  }
  double mean = 0.0, square = 0.0;
  for (const double w : without) mean += w / static_cast<double>(kParts);
  for (const double w : without) square += (w - mean) * (w - mean);
  const double u = std::sqrt(square * static_cast<double>(kParts - 1) / static_cast<double>(kParts));
  return StreamOffset{y_name, x_name, whole.lag_s, u, whole.correlation};
}

void record(CheckState& s, const std::optional<StreamOffset>& o) {
  constexpr double kMostUncertain_s = 0.006;
  if (!o || o->u_s > kMostUncertain_s) return;
  s.result.offsets.pairs.push_back(*o);
  s.note(o->stream,
         fmt::format("stamps {:+.1f} ms late against {} (u {:.1f} ms, correlation {:.2f})", 1e3 * o->late_s, o->against, 1e3 * o->u_s,
                     o->correlation),
         s.span());
}

// What of the force goes with the motion and not with the speeds at once. Climbing takes thrust away, and the climb is the integral of
// the force: at 1 Hz that alone turns the force ahead of the speeds by 20 ms. Flying forward adds thrust with the square of the speed.
enum class Airflow { climb, climb_and_forward };

// The parts that go with Σω times the climb speed, and with the square of the in-plane speed, are fitted beside Σω² and taken out of the
// force. The speeds are read `late_s` late meanwhile.
void take_out_airflow(const FlightGrid& g, Airflow which, const std::vector<double>& lift, double late_s, std::vector<double>& up) {
  const auto shift = static_cast<std::ptrdiff_t>(std::round(late_s / g.grid.dt_s));
  const auto n = static_cast<std::ptrdiff_t>(up.size());
  const double scale = 1.0 / (median(lift) + 1e-9);
  std::vector<double> climb(up.size()), forward(up.size());
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const auto here = static_cast<std::size_t>(i), read = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i + shift, 0, n - 1));
    const RotorValues& w = g.omega_rad_s[read];
    const Eigen::Vector3d v = g.q_WB[here].conjugate() * (g.has_velocity ? g.velocity_W_m_s[here] : g.position_rate_W_m_s[here]);
    climb[here] = v.z() * (w[0] + w[1] + w[2] + w[3]) * std::sqrt(scale);
    forward[here] = which == Airflow::climb ? 0.0 : v.head<2>().squaredNorm();
    if (!g.valid[here]) continue;
    const Eigen::Vector4d row(lift[read] * scale, climb[here], forward[here], 1.0);
    normal += row * row.transpose();
    right += row * up[here];
  }
  const Eigen::Vector4d x = LdltFactor(normal + 1e-9 * Eigen::Matrix4d::Identity()).solve(Eigen::VectorXd(right));
  const double climb_gain = std::min(0.0, x[1]);  // physics has it negative; a fit that says otherwise saw something else
  for (std::size_t i = 0; i < up.size(); ++i) up[i] -= climb_gain * climb[i] + x[2] * forward[i];
}

Channels sum_of_squares(const FlightGrid& g) {
  Channels c(1, std::vector<double>(g.grid.count));
  for (std::size_t i = 0; i < g.grid.count; ++i)
    for (const double w : g.omega_rad_s[i]) c[0][i] += w * w;
  return c;
}

// How late the speeds are and how much of the force is airflow depend on each other: a few rounds settle both.
std::optional<StreamOffset> rotor_offset(CheckState& s, const FlightGrid& g, const char* against, const Channels& up, Airflow which) {
  const Channels lift = sum_of_squares(g);
  std::optional<StreamOffset> o = estimate(s, g, stream_name::rotors, lift, against, up, kClimbCorner_hz, kLeastLiftCorrelation);
  for (int round = 0; round < 3 && o && g.has_attitude; ++round) {
    Channels without = up;
    take_out_airflow(g, which, lift[0], o->late_s, without[0]);
    o = estimate(s, g, stream_name::rotors, lift, against, without, kClimbCorner_hz, kLeastLiftCorrelation);
  }
  return o;
}

void record_rotor_offset(CheckState& s, const FlightGrid& g) {
  constexpr double kOfPeriod = 0.1;  // stamps and interpolation are no better than a tenth of the sample time
  const Eigen::Vector3d gravity = kGravity_m_s2 * Eigen::Vector3d::UnitZ();
  Channels up(1, std::vector<double>(g.grid.count));
  for (std::size_t i = 0; i < up[0].size(); ++i)
    up[0][i] = g.has_accel ? g.accel_B_m_s2[i].z() : (g.q_WB[i].conjugate() * (g.position_acc_W_m_s2[i] + gravity)).z();
  const char* against = g.has_accel ? stream_name::accel : stream_name::pose;
  std::optional<StreamOffset> o = rotor_offset(s, g, against, up, Airflow::climb_and_forward);
  if (o && g.has_attitude) {
    // Noise is the smaller part of what is unknown: thrust does more than the airflow taken out here. What taking out one part of it
    // changed stands for what the parts that are left would change.
    const auto cruder = rotor_offset(s, g, against, up, Airflow::climb);
    if (!cruder) return;
    const double floor_s = kOfPeriod * std::max(period_s(s.record.rotor_omega_rad_s), period_s(s.record.accel_B_m_s2));
    o->u_s = std::hypot(o->u_s, o->late_s - cruder->late_s, floor_s);
  }
  record(s, o);
}

}  // namespace

void check_offsets(CheckState& s) {
  const FlightGrid g = make_grid(s, kOffsetCorner_hz);
  if (g.grid.count < 400) return;
  if (g.has_gyro && g.has_attitude)
    record(s, estimate(s, g, stream_name::pose, channels(g.pose_rate_B_rad_s), stream_name::gyro, channels(g.gyro_B_rad_s), 1.0));
  if (s.refused()) return;
  if (g.has_accel && g.has_attitude) {
    std::vector<Eigen::Vector3d> felt(g.grid.count);
    for (std::size_t i = 0; i < felt.size(); ++i) felt[i] = g.q_WB[i] * g.accel_B_m_s2[i];
    record(s, estimate(s, g, stream_name::pose, channels(g.position_acc_W_m_s2), stream_name::accel, channels(felt), 0.5));
  }
  if (g.has_rotors && (g.has_accel || g.has_attitude)) record_rotor_offset(s, g);
  if (g.has_velocity && g.has_position)
    record(s, estimate(s, g, stream_name::velocity, channels(g.velocity_W_m_s), g.has_attitude ? stream_name::pose : stream_name::position,
                       channels(g.position_rate_W_m_s), 0.5));
}

const StreamOffset* StreamOffsets::find(const std::string& stream, const std::string& against) const {
  for (const StreamOffset& p : pairs)
    if (p.stream == stream && p.against == against) return &p;
  return nullptr;
}

std::optional<StreamOffset> StreamOffsets::between(const std::string& stream, const std::string& against) const {
  const auto direct = [&](const std::string& a, const std::string& b) -> std::optional<StreamOffset> {
    if (const StreamOffset* p = find(a, b)) return *p;
    if (const StreamOffset* p = find(b, a)) return StreamOffset{a, b, -p->late_s, p->u_s, p->correlation};
    return std::nullopt;
  };
  if (auto d = direct(stream, against)) return d;
  for (const StreamOffset& p : pairs) {
    for (const std::string& middle : {p.stream, p.against}) {
      const auto first = direct(stream, middle), second = direct(middle, against);
      if (first && second)
        return StreamOffset{stream, against, first->late_s + second->late_s, std::hypot(first->u_s, second->u_s),
                            std::min(first->correlation, second->correlation)};
    }
  }
  return std::nullopt;
}

}  // namespace rotorloop::log
