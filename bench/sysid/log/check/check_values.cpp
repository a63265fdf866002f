// Faults that one stream shows by itself: spikes, jumps that stay, channels that freeze, sensors at the end of their range.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/sysid/log/check/check_steps.hpp"
#include "bench/sysid/log/check/stream_access.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::log {
namespace {

// A spike stands out of the median of its neighbourhood by more than `floor` and by more than 12 times the usual distance. The floor
// is what no vehicle does between two samples and back: it keeps a sharp but real peak of a slow log.
struct SpikeRule {
  std::size_t half_window;
  double floor;
  const char* unit;
};
constexpr double kSpikeDeviations = 12.0;

std::vector<double> distance_from_neighbours(const std::vector<double>& v, std::size_t half) {
  std::vector<double> d(v.size());
  std::vector<double> window;
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::size_t from = i > half ? i - half : 0, to = std::min(v.size(), i + half + 1);
    window.assign(v.begin() + static_cast<std::ptrdiff_t>(from), v.begin() + static_cast<std::ptrdiff_t>(to));
    d[i] = v[i] - median(window);
  }
  return d;
}

template <class Value>
void drop_spikes(CheckState& s, const std::string& name, Stream<Value>& stream, std::size_t first, std::size_t last, SpikeRule rule) {
  if (stream.size() < 4 * rule.half_window) return;
  std::vector<char> spike(stream.size(), 0);
  std::vector<double> where;
  double worst = 0.0;
  for (std::size_t c = first; c < last; ++c) {
    const std::vector<double> d = distance_from_neighbours(channel(stream, c), rule.half_window);
    const double limit = std::max(rule.floor, kSpikeDeviations * robust_deviation(d));
    for (std::size_t i = 0; i < d.size(); ++i) {
      const bool at_end = i < rule.half_window || i + rule.half_window >= d.size();  // half a neighbourhood follows no slope
      if (std::abs(d[i]) <= (at_end ? 3.0 : 1.0) * limit) continue;
      spike[i] = 1;
      if (std::abs(d[i]) > std::abs(worst)) worst = d[i];
    }
  }
  const auto count = std::count(spike.begin(), spike.end(), char{1});
  // More are no spikes but a wrong unit, which later checks name.
  constexpr double kMostSpikes = 0.2;
  if (count == 0 || static_cast<double>(count) > kMostSpikes * static_cast<double>(stream.size())) return;
  const TimeRange range = stretches(stream.t_s, spike, HUGE_VAL).front();
  s.exclude(name, fmt::format("{} samples spike out of their neighbours, by up to {:.3g} {}", count, worst, rule.unit), range);
  std::vector<char> keep(spike.size());
  for (std::size_t i = 0; i < spike.size(); ++i) keep[i] = !spike[i];
  stream = kept(stream, keep);
}

// Position that moves at once and stays there: a tracker that lost and found the vehicle. Both parts are good, but no step may join
// them. A log that repeats its last sample jumps too, by what the vehicle flew meanwhile: up to a tenth of a second is allowed for.
template <class Value>
void split_at_jumps(CheckState& s, const std::string& name, const Stream<Value>& stream) {
  constexpr double kLeastJump_m = 0.06, kRepeated_s = 0.1;
  constexpr std::size_t kAround = 10;
  const std::size_t n = stream.size();
  if (n < 2 * kAround + 2) return;
  std::vector<double> step_m(n, 0.0), speed_m_s(n, 0.0);
  for (std::size_t i = 1; i < n; ++i) {
    const auto a = channels_of(stream.value[i - 1]), b = channels_of(stream.value[i]);
    step_m[i] = std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    speed_m_s[i] = step_m[i] / (stream.t_s[i] - stream.t_s[i - 1]);
  }
  for (std::size_t i = 1; i < n; ++i) {
    const std::size_t from = i > kAround ? i - kAround : 1, to = std::min(n, i + kAround + 1);
    const double usual =
        quantile({speed_m_s.begin() + static_cast<std::ptrdiff_t>(from), speed_m_s.begin() + static_cast<std::ptrdiff_t>(to)}, 0.75);
    const double dt = stream.t_s[i] - stream.t_s[i - 1];
    if (step_m[i] <= kLeastJump_m + usual * (kRepeated_s + 1.5 * dt) || s.clock_set_back(stream.t_s[i - 1], stream.t_s[i])) continue;
    const TimeRange at{stream.t_s[i - 1], stream.t_s[i]};
    s.exclude(name, fmt::format("jumps by {:.3f} m in {:.1f} ms at {:.2f} m/s, and stays: split there", step_m[i], 1e3 * dt, usual), at);
    s.split(at);
  }
}

// Attitude that turns at once and stays turned: a tracker that took one marker for another. The parts before and after are turned
// against each other in sensor axes; those that agree with the longest one stay.
void drop_turned_parts(CheckState& s) {
  constexpr double kLeastTurn_rad = 0.08, kRepeated_s = 0.05, kAgree_rad = 0.06;
  constexpr std::size_t kAround = 10;
  const auto& pose = s.record.pose;
  const std::size_t n = pose.size();
  if (n < 2 * kAround + 2) return;
  std::vector<Eigen::Quaterniond> step(n, Eigen::Quaterniond::Identity());
  std::vector<double> turned(n, 0.0), rate(n, 0.0);
  for (std::size_t i = 1; i < n; ++i) {
    if (s.clock_set_back(pose.t_s[i - 1], pose.t_s[i])) continue;
    step[i] = pose.value[i - 1].q_WS.conjugate() * pose.value[i].q_WS;
    turned[i] = 2.0 * std::atan2(step[i].vec().norm(), std::abs(step[i].w()));
    rate[i] = turned[i] / (pose.t_s[i] - pose.t_s[i - 1]);
  }
  struct Part {
    TimeRange range;
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  // of the sensor axes against the first part's
  };
  std::vector<Part> parts{{{pose.t_s.front(), pose.t_s.front()}}};
  double largest = 0.0;
  for (std::size_t i = 1; i < n; ++i) {
    const std::size_t from = i > kAround ? i - kAround : 1, to = std::min(n, i + kAround + 1);
    const double usual = quantile({rate.begin() + static_cast<std::ptrdiff_t>(from), rate.begin() + static_cast<std::ptrdiff_t>(to)}, 0.75);
    if (turned[i] > kLeastTurn_rad + usual * (kRepeated_s + 1.5 * (pose.t_s[i] - pose.t_s[i - 1]))) {
      parts.push_back({{pose.t_s[i], pose.t_s[i]}, parts.back().turn * step[i]});
      largest = std::max(largest, turned[i]);
    }
    parts.back().range.to_s = pose.t_s[i];
  }
  if (parts.size() == 1) return;
  const Part& most =
      *std::max_element(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.range.span_s() < b.range.span_s(); });
  std::vector<TimeRange> out;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (k > 0) s.split({parts[k - 1].range.to_s, parts[k].range.from_s});
    if (parts[k].turn.angularDistance(most.turn) > kAgree_rad) out.push_back(parts[k].range);
  }
  for (const TimeRange& r : joined(out, 0.2)) {
    s.exclude(
        stream_name::pose,
        fmt::format(
            "its axes are turned by {:.2f} rad from one sample to the next and stay so (likely: markers of the motion capture exchanged)",
            largest),
        r);
    s.lose(r);
  }
  if (out.empty())
    s.exclude(stream_name::pose, fmt::format("turns by {:.2f} rad between two samples: split there", largest),
              {parts[1].range.from_s, parts.back().range.from_s});
}

// Runs in which `same(i)` says that sample i shows what i-1 showed, of at least `shortest_s`.
template <class Same>
std::vector<TimeRange> runs(const std::vector<double>& t, double shortest_s, Same&& same) {
  std::vector<TimeRange> out;
  std::size_t from = 0;
  for (std::size_t i = 1; i <= t.size(); ++i) {
    if (i < t.size() && same(i)) continue;
    if (t[i - 1] - t[from] >= shortest_s) out.push_back({t[from], t[i - 1]});
    from = i;
  }
  return out;
}

// How long a live sensor may repeat itself: three tenths of a second, or fifteen of its usual samples when those are slow.
template <class Value>
double longest_repeat_s(const Stream<Value>& stream) {
  std::vector<double> steps;  // between changes: the rate of the sensor behind a log that repeats its last value
  double last = stream.t_s.front();
  for (std::size_t i = 1; i < stream.size(); ++i) {
    if (channels_of(stream.value[i]) == channels_of(stream.value[i - 1])) continue;
    steps.push_back(stream.t_s[i] - last);
    last = stream.t_s[i];
  }
  return std::max(0.3, 15.0 * median(std::move(steps)));
}

template <class Value>
void drop_within(Stream<Value>& stream, const std::vector<TimeRange>& ranges) {
  std::vector<char> keep(stream.size(), 1);
  for (const TimeRange& r : ranges)
    for (std::size_t i = 0; i < keep.size(); ++i)
      if (stream.t_s[i] > r.from_s && r.contains(stream.t_s[i])) keep[i] = 0;  // the first of the run was alive
  stream = kept(stream, keep);
}

// Channels that stand still while others of their stream change, or all of them. Returns when.
template <class Value>
std::vector<TimeRange> find_frozen(CheckState& s, const std::string& name, const Stream<Value>& stream,
                                   const std::vector<std::string>& channel_names) {
  if (stream.size() < 20) return {};
  const double shortest = longest_repeat_s(stream);
  const auto all_same = [&](std::size_t i) { return channels_of(stream.value[i]) == channels_of(stream.value[i - 1]); };
  std::vector<TimeRange> found = runs(stream.t_s, shortest, all_same);
  for (const TimeRange& r : found) s.exclude(name, fmt::format("the same values for {:.2f} s: the source stood still", r.span_s()), r);
  const std::size_t whole = found.size();
  for (std::size_t c = 0; c < channel_names.size(); ++c) {
    const std::vector<double> v = channel(stream, c);
    for (const TimeRange& r : runs(stream.t_s, shortest, [&](std::size_t i) { return v[i] == v[i - 1]; })) {
      const bool reported = std::any_of(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(whole),
                                        [&](const TimeRange& w) { return r.from_s <= w.to_s && w.from_s <= r.to_s; });
      const std::size_t at =
          static_cast<std::size_t>(std::lower_bound(stream.t_s.begin(), stream.t_s.end(), r.from_s) - stream.t_s.begin());
      if (reported || v[at] == 0.0) continue;  // zero: a dead rotor, or not turning; judged with the rotors
      s.exclude(channel_names[c], fmt::format("stands at {:.4g} for {:.2f} s while the rest of its stream changes", v[at], r.span_s()), r);
      found.push_back(r);
    }
  }
  return found;
}

// A pose or position that repeats itself is frozen only when something says that the vehicle moved meanwhile: the readings of a still
// vehicle repeat too, to the millimetre that they are rounded to.
template <class Value>
void drop_frozen_track(CheckState& s, const std::string& name, Stream<Value>& stream) {
  constexpr double kLeastFrozen_s = 0.08, kMoved_m = 0.04, kTurned_rad = 0.06;
  if (stream.size() < 20) return;
  const bool turns = channels_of(stream.value[0]).size() > 3;
  const auto same = [&](std::size_t i) { return channels_of(stream.value[i]) == channels_of(stream.value[i - 1]); };
  std::vector<TimeRange> found;
  double moved_m = 0.0, turned_rad = 0.0;
  for (const TimeRange& r : runs(stream.t_s, std::max(kLeastFrozen_s, 4.0 * period_s(stream)), same)) {
    Eigen::Vector3d path = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero();
    const auto& g = s.record.gyro_B_rad_s;
    for (std::size_t i = 1; i < g.size(); ++i)
      if (r.contains(g.t_s[i]) && r.contains(g.t_s[i - 1])) turn += g.value[i] * (g.t_s[i] - g.t_s[i - 1]);
    const auto& v = s.record.velocity_W_m_s;
    for (std::size_t i = 1; i < v.size(); ++i)
      if (r.contains(v.t_s[i]) && r.contains(v.t_s[i - 1])) path += v.value[i] * (v.t_s[i] - v.t_s[i - 1]);
    const auto after = static_cast<std::size_t>(std::upper_bound(stream.t_s.begin(), stream.t_s.end(), r.to_s) - stream.t_s.begin());
    if (after < stream.size()) {  // what it shows when it comes back
      const auto a = channels_of(stream.value[after]), b = channels_of(stream.value[after - 1]);
      path = path.norm() > 0.0 ? path : Eigen::Vector3d(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    }
    if (path.norm() < kMoved_m && !(turns && turn.norm() > kTurned_rad)) continue;
    found.push_back(r);
    moved_m = std::max(moved_m, path.norm());
    turned_rad = std::max(turned_rad, turn.norm());
  }
  if (found.empty()) return;
  double longest = 0.0, sum = 0.0;
  for (const TimeRange& r : found) {
    longest = std::max(longest, r.span_s());
    sum += r.span_s();
  }
  s.exclude(name,
            fmt::format("repeats one reading {} times for more than {:.2f} s ({:.2f} s together, longest {:.2f} s) while the vehicle moved "
                        "by up to {:.2f} m{}",
                        found.size(), kLeastFrozen_s, sum, longest, moved_m,
                        turns ? fmt::format(" and turned by up to {:.2f} rad", turned_rad) : ""),
            {found.front().from_s, found.back().to_s});
  drop_within(stream, found);
}

// Three samples in a row at exactly the largest value that a channel ever shows: the end of the sensor's range. A free signal repeats
// its extreme to the last digit only by chance.
void drop_saturated(CheckState& s, const std::string& name, Stream<Eigen::Vector3d>& stream, double least, const char* unit) {
  std::vector<char> bad(stream.size(), 0);
  double limit = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<double> v = channel(stream, c);
    for (const double sign : {1.0, -1.0}) {
      double top = 0.0;
      for (const double x : v) top = std::max(top, sign * x);
      if (top < least) continue;
      for (std::size_t i = 2; i < v.size(); ++i) {
        if (sign * v[i] < top || sign * v[i - 1] < top || sign * v[i - 2] < top) continue;
        bad[i] = bad[i - 1] = bad[i - 2] = 1;
        limit = std::max(limit, top);
      }
    }
  }
  const auto count = std::count(bad.begin(), bad.end(), char{1});
  if (count == 0) return;
  s.exclude(name, fmt::format("{} samples at the end of its range, {:.4g} {}", count, limit, unit),
            stretches(stream.t_s, bad, HUGE_VAL).front());
  for (char& b : bad) b = !b;
  stream = kept(stream, bad);
}

void note_command_limits(CheckState& s) {
  const auto& m = s.record.motor_command;
  for (std::size_t c = 0; c < 4 && !m.empty(); ++c) {
    std::vector<char> top(m.size());
    for (std::size_t i = 0; i < m.size(); ++i) top[i] = m.value[i][c] >= 0.999;
    const auto count = std::count(top.begin(), top.end(), char{1});
    if (count == 0) continue;
    s.note(fmt::format("motor {} command", c + 1),
           fmt::format("at full command in {:.1f} % of its samples: the speed no longer follows the command there",
                       100.0 * static_cast<double>(count) / static_cast<double>(m.size())),
           stretches(m.t_s, top, HUGE_VAL).front());
  }
}

void drop_battery_that_is_no_measurement(CheckState& s) {
  auto& b = s.record.battery_V;
  if (b.empty() || s.span().span_s() < 5.0) return;  // one sample: a log whose repeated values were dropped
  if (std::any_of(b.value.begin(), b.value.end(), [&](double v) { return v != b.value.front(); })) return;
  s.exclude(stream_name::battery,
            fmt::format("reads {:.3f} V from first to last sample: a constant of the log, not a measurement", b.value.front()),
            {b.t_s.front(), b.t_s.back()});
  b = {};
}

// A quaternion and its negative are one attitude; a log may change from one to the other.
void follow_quaternion_sign(CheckState& s) {
  auto& pose = s.record.pose;
  std::vector<char> changed(pose.size(), 0);
  for (std::size_t i = 1; i < pose.size(); ++i) {
    Eigen::Quaterniond& q = pose.value[i].q_WS;
    if (q.dot(pose.value[i - 1].q_WS) >= 0.0) continue;
    q.coeffs() = -q.coeffs();
    changed[i] = 1;
  }
  std::size_t flips = 0;
  for (std::size_t i = 1; i < changed.size(); ++i) flips += changed[i] != changed[i - 1];
  if (flips > 0)
    s.note(stream_name::pose, fmt::format("the quaternion changed its sign {} times: made continuous", flips),
           stretches(pose.t_s, changed, HUGE_VAL).front());
}

constexpr double kPositionSpike_m = 0.08;  // one sample off the path by more than a hold of the sample before it explains

}  // namespace

void check_values(CheckState& s) {
  FlightRecord& r = s.record;
  follow_quaternion_sign(s);
  if (!r.rotor_omega_rad_s.empty()) {
    std::vector<double> all;
    for (const RotorValues& w : r.rotor_omega_rad_s.value)
      for (const double x : w) all.push_back(std::abs(x));
    for (const TimeRange& f :
         find_frozen(s, stream_name::rotors, r.rotor_omega_rad_s, {"rotor 1 speed", "rotor 2 speed", "rotor 3 speed", "rotor 4 speed"}))
      s.lose(f);  // without its input no step of a fit is worth anything
    // A rotor of 5 inch changes its speed by 1 % per millisecond at most, one of 2 inch by 3 %.
    drop_spikes(s, stream_name::rotors, r.rotor_omega_rad_s, 0, 4, {3, 0.25 * quantile(std::move(all), 0.75), "rad/s"});
  }
  drop_within(r.gyro_B_rad_s, find_frozen(s, stream_name::gyro, r.gyro_B_rad_s, {"gyro x", "gyro y", "gyro z"}));
  drop_within(r.accel_B_m_s2,
              find_frozen(s, stream_name::accel, r.accel_B_m_s2, {"accelerometer x", "accelerometer y", "accelerometer z"}));
  drop_frozen_track(s, stream_name::pose, r.pose);
  drop_frozen_track(s, stream_name::position, r.position_W_m);
  drop_saturated(s, stream_name::gyro, r.gyro_B_rad_s, 4.0, "rad/s");    // the least range on sale is 125 deg/s, seldom used: 4.36
  drop_saturated(s, stream_name::accel, r.accel_B_m_s2, 15.0, "m/s^2");  // the least range on sale is 2 g
  drop_spikes(s, stream_name::gyro, r.gyro_B_rad_s, 0, 3, {2, 3.0, "rad/s"});
  drop_spikes(s, stream_name::accel, r.accel_B_m_s2, 0, 3, {2, 15.0, "m/s^2"});
  check_bursts(s);
  drop_spikes(s, stream_name::pose, r.pose, 0, 3, {2, kPositionSpike_m, "m"});
  drop_spikes(s, stream_name::pose, r.pose, 3, 7, {2, 0.05, "in a component of the quaternion"});
  drop_spikes(s, stream_name::position, r.position_W_m, 0, 3, {2, kPositionSpike_m, "m"});
  drop_spikes(s, stream_name::velocity, r.velocity_W_m_s, 0, 3, {2, 0.5, "m/s"});
  drop_turned_parts(s);
  split_at_jumps(s, stream_name::pose, r.pose);
  split_at_jumps(s, stream_name::position, r.position_W_m);
  note_command_limits(s);
  drop_battery_that_is_no_measurement(s);
}

}  // namespace rotorloop::log
