// Faults that one stream shows by itself: spikes, jumps that stay, channels that freeze, sensors at the end of their range.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/identify/check_steps.hpp"
#include "bench/identify/stream_access.hpp"

namespace rotorloop::bench {
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
      if (std::abs(d[i]) <= limit) continue;
      spike[i] = 1;
      if (std::abs(d[i]) > std::abs(worst)) worst = d[i];
    }
  }
  const auto count = std::count(spike.begin(), spike.end(), char{1});
  if (count == 0) return;
  const TimeRange range = stretches(stream.t_s, spike, HUGE_VAL).front();
  s.exclude(name, fmt::format("{} samples spike out of their neighbours, by up to {:.3g} {}", count, worst, rule.unit), range);
  std::vector<char> keep(spike.size());
  for (std::size_t i = 0; i < spike.size(); ++i) keep[i] = !spike[i];
  stream = kept(stream, keep);
}

// Position that moves at once and stays there: a tracker that lost and found the vehicle. No sample is wrong by itself, but the two
// parts do not belong to one trajectory: the shorter one goes.
template <class Value>
void cut_at_jumps(CheckState& s, const std::string& name, Stream<Value>& stream) {
  constexpr double kLeastJump_m = 0.06;
  constexpr double kJumpDeviations = 15.0;
  const std::size_t n = stream.size();
  if (n < 20) return;
  const auto p = [&](std::size_t i) { return Eigen::Vector3d(channels_of(stream.value[i])[0], channels_of(stream.value[i])[1], channels_of(stream.value[i])[2]); };
  std::vector<double> surprise(n, 0.0);  // distance from where the speed before and after would have led
  for (std::size_t i = 3; i + 2 < n; ++i) {
    const double dt = stream.t_s[i] - stream.t_s[i - 1];
    if (dt > 0.1) continue;
    const Eigen::Vector3d before = (p(i - 1) - p(i - 3)) / (stream.t_s[i - 1] - stream.t_s[i - 3]);
    const Eigen::Vector3d after = (p(i + 2) - p(i)) / (stream.t_s[i + 2] - stream.t_s[i]);
    surprise[i] = (p(i) - p(i - 1) - 0.5 * dt * (before + after)).norm();
  }
  const double limit = std::max(kLeastJump_m, kJumpDeviations * median(surprise));
  std::vector<double> at{stream.t_s.front()};
  for (std::size_t i = 0; i < n; ++i) {
    if (surprise[i] <= limit) continue;
    s.exclude(name, fmt::format("jumps by {:.3f} m between two samples and stays; the shorter part is left out", surprise[i]),
              {stream.t_s[i - 1], stream.t_s[i]});
    at.push_back(stream.t_s[i]);
  }
  if (at.size() == 1) return;
  at.push_back(stream.t_s.back());
  std::size_t longest = 0;
  for (std::size_t k = 0; k + 1 < at.size(); ++k)
    if (at[k + 1] - at[k] > at[longest + 1] - at[longest]) longest = k;
  if (longest > 0) s.unusable.push_back({at.front(), at[longest]});
  if (longest + 2 < at.size()) s.unusable.push_back({at[longest + 1] - 1e-9, at.back()});
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
void find_frozen(CheckState& s, const std::string& name, Stream<Value>& stream, const std::vector<std::string>& channel_names) {
  if (stream.size() < 20) return;
  const double shortest = longest_repeat_s(stream);
  const auto all_same = [&](std::size_t i) { return channels_of(stream.value[i]) == channels_of(stream.value[i - 1]); };
  std::vector<TimeRange> whole = runs(stream.t_s, shortest, all_same);
  for (const TimeRange& r : whole) {
    s.exclude(name, fmt::format("the same values for {:.2f} s: the source stood still", r.span_s()), r);
    s.unusable.push_back(r);
  }
  for (std::size_t c = 0; c < channel_names.size(); ++c) {
    const std::vector<double> v = channel(stream, c);
    for (const TimeRange& r : runs(stream.t_s, shortest, [&](std::size_t i) { return v[i] == v[i - 1]; })) {
      const bool told = std::any_of(whole.begin(), whole.end(), [&](const TimeRange& w) { return r.from_s <= w.to_s && w.from_s <= r.to_s; });
      const std::size_t at = static_cast<std::size_t>(std::lower_bound(stream.t_s.begin(), stream.t_s.end(), r.from_s) - stream.t_s.begin());
      if (told || v[at] == 0.0) continue;  // zero: a dead rotor, or not turning; judged with the rotors
      const std::string who = channel_names.size() > 1 ? channel_names[c] : name;
      s.exclude(who, fmt::format("stands at {:.4g} for {:.2f} s while the rest of its stream changes", v[at], r.span_s()), r);
      s.unusable.push_back(r);
    }
  }
}

// A pose that repeats itself is frozen only when something else says that the vehicle moved: millimetres of a still vehicle repeat too.
void find_frozen_pose(CheckState& s) {
  const auto& pose = s.record.pose;
  if (pose.size() < 20) return;
  const auto same = [&](std::size_t i) { return channels_of(pose.value[i]) == channels_of(pose.value[i - 1]); };
  for (const TimeRange& r : runs(pose.t_s, std::max(0.15, 10.0 * period_s(pose)), same)) {
    double turned_rad = 0.0, moved_m = 0.0;
    const auto& g = s.record.gyro_B_rad_s;
    for (std::size_t i = 1; i < g.size(); ++i)
      if (r.contains(g.t_s[i]) && r.contains(g.t_s[i - 1])) turned_rad += g.value[i].norm() * (g.t_s[i] - g.t_s[i - 1]);
    const auto& v = s.record.velocity_W_m_s;
    for (std::size_t i = 1; i < v.size(); ++i)
      if (r.contains(v.t_s[i]) && r.contains(v.t_s[i - 1])) moved_m += v.value[i].norm() * (v.t_s[i] - v.t_s[i - 1]);
    if (turned_rad < 0.05 && moved_m < 0.03 && !(g.empty() && v.empty() && r.span_s() > 0.5)) continue;
    s.exclude(stream_name::pose, fmt::format("the same pose for {:.2f} s while the vehicle turned {:.2f} rad and moved {:.2f} m", r.span_s(), turned_rad, moved_m), r);
    s.unusable.push_back(r);
  }
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
  s.exclude(name, fmt::format("{} samples at the end of its range, {:.4g} {}", count, limit, unit), stretches(stream.t_s, bad, HUGE_VAL).front());
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
  if (b.size() < 2 || b.t_s.back() - b.t_s.front() < 5.0) return;
  if (std::any_of(b.value.begin(), b.value.end(), [&](double v) { return v != b.value.front(); })) return;
  s.exclude(stream_name::battery,
            fmt::format("reads {:.3f} V from first to last sample: a constant of the log, not a measurement", b.value.front()),
            {b.t_s.front(), b.t_s.back()});
  b = {};
}

}  // namespace

void check_values(CheckState& s) {
  FlightRecord& r = s.record;
  if (!r.rotor_omega_rad_s.empty()) {
    std::vector<double> all;
    for (const RotorValues& w : r.rotor_omega_rad_s.value) all.insert(all.end(), w.begin(), w.end());
    find_frozen(s, stream_name::rotors, r.rotor_omega_rad_s, {"rotor 1 speed", "rotor 2 speed", "rotor 3 speed", "rotor 4 speed"});
    // A rotor of 5 inch changes its speed by 1 % per millisecond at most, one of 2 inch by 3 %.
    drop_spikes(s, stream_name::rotors, r.rotor_omega_rad_s, 0, 4, {3, 0.25 * quantile(std::move(all), 0.75), "rad/s"});
  }
  find_frozen(s, stream_name::gyro, r.gyro_B_rad_s, {"gyro x", "gyro y", "gyro z"});
  find_frozen(s, stream_name::accel, r.accel_B_m_s2, {"accelerometer x", "accelerometer y", "accelerometer z"});
  find_frozen_pose(s);
  drop_saturated(s, stream_name::gyro, r.gyro_B_rad_s, 4.0, "rad/s");         // the least range on sale is 125 deg/s, seldom used: 4.36
  drop_saturated(s, stream_name::accel, r.accel_B_m_s2, 15.0, "m/s^2");       // the least range on sale is 2 g
  drop_spikes(s, stream_name::gyro, r.gyro_B_rad_s, 0, 3, {2, 3.0, "rad/s"});
  drop_spikes(s, stream_name::accel, r.accel_B_m_s2, 0, 3, {2, 15.0, "m/s^2"});
  drop_spikes(s, stream_name::pose, r.pose, 0, 3, {2, 0.04, "m"});
  drop_spikes(s, stream_name::position, r.position_W_m, 0, 3, {2, 0.04, "m"});
  drop_spikes(s, stream_name::velocity, r.velocity_W_m_s, 0, 3, {2, 0.5, "m/s"});
  cut_at_jumps(s, stream_name::pose, r.pose);
  cut_at_jumps(s, stream_name::position, r.position_W_m);
  note_command_limits(s);
  drop_battery_that_is_no_measurement(s);
}

}  // namespace rotorloop::bench
