#include "bench/sysid/estimate/grid_flight.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/sysid/estimate/model/local_parabola.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "bench/sysid/log/stream_reader.hpp"
#include "host/base/error.hpp"
#include "host/base/rotation_between.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::estimate {
namespace {

// The measurements around a node, by their distance in half steps.
using Gathered = LocalParabola<3>;

// The mean of measurements over a step h is off by ẅ h² / 24 from what they are in its middle, and a state between two nodes by up to
// ẅ h² / 8 from the line between theirs: at 100 steps a second a gyro of 200 Hz read so runs beside the attitude like a mount of 5e-6 s².
// The parabola through the measurements counts, at the node: through those nearest to it where they are ten or more, else through those
// within a whole step on either side, of which five say as much as a mean of two. Where that would be noisier than the mean (a gap, the
// ends, a sensor as slow as the grid): the mean of the nearest, at its own time.
constexpr double kMeasurementsForParabola = 9.5, kEven = 0.1, kNoisier = 1.25;  // the last: of a variance

std::vector<VectorFix> gathered(const log::Stream<Eigen::Vector3d>& s, const GridFlight& g) {
  std::vector<VectorFix> out;
  const double half = 0.5 * g.step_s;
  std::size_t first = 0;  // of the measurements that may count for the node
  for (std::size_t node = 0; node < g.nodes; ++node) {
    const auto place = [&](std::size_t i) { return (s.t_s[i] - g.time_s(node)) / half; };
    constexpr double kNear = 1.0, kWide = 2.0 + 1e-6;
    while (first < s.size() && place(first) < -kWide) ++first;
    Gathered near, wide;
    for (std::size_t i = first; i < s.size() && place(i) <= kWide; ++i) {
      if (!s.value[i].allFinite()) continue;
      wide.add(place(i), s.value[i]);
      if (place(i) >= -kNear && place(i) < kNear) near.add(place(i), s.value[i]);
    }
    if (near.count() < 0.5) continue;
    if (near.count() > kMeasurementsForParabola && std::fabs(near.mean_place()) < kEven) {
      out.push_back({node, 0.0, near.at_moment()});
    } else if (wide.count() > 2.5 && wide.variance_at_moment() * near.count() < kNoisier) {
      out.push_back({node, 0.0, wide.at_moment()});
    } else {
      out.push_back({node, half * near.mean_place(), near.mean()});
    }
  }
  return out;
}

// Of the load on a string, at each node. Throws Error when the log does not hold it.
std::vector<Eigen::Vector3d> load_places(const log::FlightRecord& record, const GridFlight& g) {
  std::vector<log::StreamReader<double>> axes;
  for (const char* name : {"payload_x[m]", "payload_y[m]", "payload_z[m]"}) {
    const auto found = record.extra.find(name);
    if (found == record.extra.end() || found->second.size() < 2) {
      throw Error({record.source.empty() ? record.name : record.source, fmt::format("no stream {}: where the load is cannot be used", name),
                   "the log or the mapping file does not name it", "map the three columns as `extra`, or leave the load's place out"},
                  ExitCode::data_quality);
    }
    axes.emplace_back(found->second);
  }
  std::vector<Eigen::Vector3d> out;
  for (std::size_t k = 0; k < g.nodes; ++k) out.emplace_back(axes[0].at(g.time_s(k)), axes[1].at(g.time_s(k)), axes[2].at(g.time_s(k)));
  return out;
}

}  // namespace

GridFlight make_grid(const log::FlightRecord& record, const GridOptions& o) {
  const auto fail = [&](const std::string& what, const std::string& likely, const std::string& remedy) {
    throw Error({record.source.empty() ? record.name : record.source, what, likely, remedy}, ExitCode::data_quality);
  };
  const bool pose = o.use_pose && !record.pose.empty(), place = !record.position_W_m.empty();
  if (!pose && (record.gyro_B_rad_s.empty() || record.accel_B_m_s2.empty())) {
    fail(fmt::format("{} poses, {} gyro and {} accelerometer measurements: a fit needs poses, or gyro and accelerometer",
                     record.pose.size(), record.gyro_B_rad_s.size(), record.accel_B_m_s2.size()),
         "columns p_x[m] … q_z[1], or gyro_x[rad/s] … accel_z[m/s2], are missing",
         "log one of the two sets; in a mapping add [[stream]] with quantity = \"pose\", or with \"gyro\" and \"accel\"");
  }
  GridFlight g{.name = record.name,
               .linked = {},
               .pose = {},
               .position = {},
               .velocity = {},
               .gyro = {},
               .accel = {},
               .load_W_m = {},
               .input = RotorInput(record, 0.012, o.longest_gap_s)};
  const std::vector<double>& clock = pose ? record.pose.t_s : record.gyro_B_rad_s.t_s;
  double rate = o.rate_Hz;
  if (rate <= 0.0) rate = std::clamp(std::round(1.0 / std::max(median_step(clock), 1e-4)), 100.0, 500.0);
  if (!(rate >= 20.0 && rate <= 2000.0)) {
    throw Error({g.name, fmt::format("{} states a second; allowed are 20 to 2000, or 0 for the rate of the poses", rate), "",
                 "choose another --rate"});
  }
  g.step_s = 1.0 / rate;
  g.slopes_by_middle = o.slopes_by_middle;
  g.substeps = std::max(1, static_cast<int>(std::ceil(g.step_s / o.longest_substep_s - 1e-9)));
  // The grid starts at a measurement, so that a sensor with the grid's own rate is read at the nodes.
  const double from = std::max({o.from_s, g.input.first_s(), clock.front()});
  const double to = std::min({o.to_s, g.input.last_s(), clock.back()});
  const auto first = std::lower_bound(clock.begin(), clock.end(), from - 1e-9);
  if (first == clock.end() || to - *first < 1.0) {
    fail(fmt::format("{:.2f} s of flight with rotor speeds and {} together; at least 1 s is needed", std::max(0.0, to - from),
                     pose ? "poses" : "inertial readings"),
         "streams do not overlap in time, or the checks excluded most of the flight", "look at the streams with `rotorloop log info`");
  }
  constexpr double kLongest_s = 4 * 3600.0;
  if (to - *first > kLongest_s) {
    fail(fmt::format("the log spans {:.0f} s; at most {:.0f} s can be fitted as one flight", to - *first, kLongest_s),
         "a wild time stamp, or several flights in one file", "cut the log with --from and --to");
  }
  g.start_s = *first;
  g.nodes = static_cast<std::size_t>(std::floor((to - g.start_s) / g.step_s + 1e-6)) + 1;
  g.linked.assign(g.nodes - 1, 1);
  for (std::size_t k = 0; k + 1 < g.nodes; ++k) g.linked[k] = g.input.covers(g.time_s(k) + 1e-9, g.time_s(k + 1) - 1e-9);

  if (pose) {
    for (std::size_t i = 0; i < record.pose.size(); ++i) {
      const double at = (record.pose.t_s[i] - g.start_s) / g.step_s;
      if (at < -0.5 || at > static_cast<double>(g.nodes) - 0.5 || !record.pose.value[i].p_W_m.allFinite() ||
          !record.pose.value[i].q_WS.coeffs().allFinite())
        continue;
      const auto node = static_cast<std::size_t>(std::min(std::max(std::floor(at + 0.5), 0.0), static_cast<double>(g.nodes - 1)));
      const PoseFix fix{node, record.pose.t_s[i] - g.time_s(node), record.pose.value[i]};
      // A pose cannot be averaged: of several around a node the nearest counts.
      if (!g.pose.empty() && g.pose.back().node == node) {
        if (std::fabs(fix.late_s) < std::fabs(g.pose.back().late_s)) g.pose.back() = fix;
      } else {
        g.pose.push_back(fix);
      }
    }
  } else {
    g.anchor << 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.1, 0.1, 0.01, 3.0, 3.0, 3.0;
  }
  if (place) g.position = gathered(record.position_W_m, g);
  if (o.use_velocity) g.velocity = gathered(record.velocity_W_m_s, g);
  if (o.use_gyro || !pose) g.gyro = gathered(record.gyro_B_rad_s, g);
  if (o.use_accel || !pose) g.accel = gathered(record.accel_B_m_s2, g);

  if (o.use_load) g.load_W_m = load_places(record, g);

  drop_short_pieces(g);
  return g;
}

std::size_t neighbour(const GridFlight& g, const VectorFix& fix) {
  const std::size_t k = fix.node;
  if (fix.late_s < 0.0 && k > 0 && g.linked[k - 1]) return k - 1;
  if (fix.late_s > 0.0 && k + 1 < g.nodes && g.linked[k]) return k + 1;
  return k;
}

std::size_t GridFlight::tied_nodes() const {
  std::size_t n = 0;
  for (std::size_t k = 0; k < nodes; ++k) n += tied(k);
  return n;
}

void drop_short_pieces(GridFlight& g) {
  const bool pose = !g.pose.empty();
  std::vector<std::uint8_t> keep(g.nodes, 1);
  const auto shortest = static_cast<std::size_t>(std::ceil(0.2 / g.step_s));
  std::size_t next_pose = 0;
  for (std::size_t begin = 0; begin < g.nodes;) {
    std::size_t end = begin;
    while (end + 1 < g.nodes && g.linked[end]) ++end;
    std::size_t measurements = 0;
    for (; next_pose < g.pose.size() && g.pose[next_pose].node <= end; ++next_pose) ++measurements;
    if (end - begin < shortest || (pose && measurements < 4))
      std::fill(keep.begin() + static_cast<std::ptrdiff_t>(begin), keep.begin() + static_cast<std::ptrdiff_t>(end) + 1, 0);
    begin = end + 1;
  }
  const auto drop = [&](auto& list) { std::erase_if(list, [&](const auto& f) { return !keep[f.node]; }); };
  drop(g.pose);
  drop(g.position);
  drop(g.velocity);
  drop(g.gyro);
  drop(g.accel);
  for (std::size_t k = 0; k + 1 < g.nodes; ++k) g.linked[k] = g.linked[k] && keep[k] && keep[k + 1];
  const double left_s = static_cast<double>(std::count(g.linked.begin(), g.linked.end(), 1)) * g.step_s;
  if (left_s < 1.0) {
    throw Error(
        {g.name,
         fmt::format("{:.2f} s of {:.2f} s are left after cuts at gaps; at least 1 s is needed", left_s, g.time_s(g.nodes - 1) - g.start_s),
         "rotor speeds come too slowly or with gaps (a gap is 0.05 s without a measurement), or poses are missing for long",
         "log rotor speeds at 100 Hz or more; look at the streams with `rotorloop log info`"},
        ExitCode::data_quality);
  }
}

void associate_poses(GridFlight& g, double delay_s) {
  std::vector<PoseFix> tied;
  for (const PoseFix& f : g.pose) {
    const double stamp = g.time_s(f.node) + f.late_s, at = std::floor((stamp - delay_s - g.start_s) / g.step_s + 0.5);
    if (at < 0.0 || at > static_cast<double>(g.nodes - 1) || !g.tied(static_cast<std::size_t>(at))) continue;
    const PoseFix moved{static_cast<std::size_t>(at), stamp - (g.start_s + at * g.step_s), f.value};
    if (tied.empty() || tied.back().node != moved.node) {
      tied.push_back(moved);
    } else if (std::fabs(moved.late_s - delay_s) < std::fabs(tied.back().late_s - delay_s)) {
      tied.back() = moved;
    }
  }
  g.pose = std::move(tied);
}

std::vector<BodyState> guess_states(const GridFlight& g, const ModelValues& values) {
  std::vector<BodyState> x(g.nodes);
  const Eigen::Vector3d r(values[kOffsetX], values[kOffsetY], values[kOffsetZ]);
  const Eigen::Quaterniond q_SB = values.q_BS().conjugate();
  if (!g.pose.empty()) {
    // Between measurements: straight lines and shortest turns.
    std::size_t i = 0;
    for (std::size_t k = 0; k < g.nodes; ++k) {
      while (i + 1 < g.pose.size() && g.pose[i + 1].node <= k) ++i;
      const PoseFix& a = g.pose[i];
      const PoseFix& b = g.pose[std::min(i + 1, g.pose.size() - 1)];
      const double ta = g.time_s(a.node) + a.late_s - values[kPoseDelay], tb = g.time_s(b.node) + b.late_s - values[kPoseDelay];
      const double s = tb > ta ? std::clamp((g.time_s(k) - ta) / (tb - ta), 0.0, 1.0) : 0.0;
      const Eigen::Vector3d turn = log_q(a.value.q_WS.conjugate() * b.value.q_WS);
      x[k].q_WB = (a.value.q_WS * exp_q(s * turn) * q_SB).normalized();
      x[k].p_W_m = a.value.p_W_m + s * (b.value.p_W_m - a.value.p_W_m) - x[k].q_WB * r;
    }
  } else {
    // Attitude from the gyro, slowly pulled upright by the specific force; position and velocity unknown: at rest.
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    std::size_t i = 0, j = 0;
    for (std::size_t k = 0; k < g.nodes; ++k) {
      while (i + 1 < g.gyro.size() && g.gyro[i + 1].node <= k) ++i;
      while (j + 1 < g.accel.size() && g.accel[j + 1].node <= k) ++j;
      if (k == 0) q = rotation_between(g.accel[j].value, Eigen::Vector3d::UnitZ());
      x[k].q_WB = q;
      x[k].w_B_rad_s = g.gyro[i].value - Eigen::Vector3d(values[kGyroBiasX], values[kGyroBiasY], values[kGyroBiasZ]);
      const Eigen::Vector3d up = q.conjugate() * Eigen::Vector3d::UnitZ(), pull = g.accel[j].value.normalized().cross(up);
      q = (q * exp_q(g.step_s * (x[k].w_B_rad_s + 0.2 * pull))).normalized();
    }
    return x;
  }
  const auto half = static_cast<std::size_t>(std::max(1.0, std::round(0.01 / g.step_s)));
  for (std::size_t k = 0; k < g.nodes; ++k) {
    const std::size_t a = k >= half ? k - half : 0, b = std::min(k + half, g.nodes - 1);
    const double h = static_cast<double>(b - a) * g.step_s;
    x[k].v_W_m_s = (x[b].p_W_m - x[a].p_W_m) / h;
    x[k].w_B_rad_s = log_q(x[a].q_WB.conjugate() * x[b].q_WB) / h;
  }
  for (const VectorFix& f : g.gyro)
    x[f.node].w_B_rad_s = f.value - Eigen::Vector3d(values[kGyroBiasX], values[kGyroBiasY], values[kGyroBiasZ]);
  return x;
}

}  // namespace rotorloop::estimate
