// Poses that leave the motion and come back: a motion capture that loses or exchanges markers for some tenths of a second. A burst that
// swells and fades, or that comes while the vehicle turns fast, has no ends that the poses alone would show; the gyro knows. Attitude by
// attitude the turn of the pose against the integrated gyro changes slowly, but for bursts.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bench/sysid/log/check/check_steps.hpp"
#include "bench/sysid/log/check/gyro_turn.hpp"
#include "bench/sysid/log/check/stream_access.hpp"
#include "host/base/rotation_vector.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::log {
namespace {

constexpr double kHalfWindow_s = 0.5;  // a burst is shorter, so that most of the poses around it are sound
constexpr double kLongestBurst_s = 0.5;
// A burst leaves the gyro by more than that, and by more than a multiple of what four fifths of the poses keep within; it has begun and
// faded at its ends. For normal errors the multiples are 8 and 3 deviations; telemetry that comes late at times has longer tails.
constexpr double kLeastBurst_rad = 0.05, kBurstMultiple = 3.7;
constexpr double kLeastAtEnds_rad = 0.012, kAtEndsMultiple = 1.4;
constexpr double kBesideBurst_s = 0.01;  // a smoothed pose takes some of a burst along
constexpr double kStaysTurned_rad = 0.15;
constexpr double kReturns = 0.5;          // of its departure: by which the poses before and after may differ
constexpr double kStampJitter_s = 0.005;  // of the stamps
constexpr double kMostBursts = 0.2;       // of the poses; more is another fault, which later checks name
constexpr std::size_t kWindowPoses = 60;  // of a window that are looked at

// How far each pose of one stretch of the gyro is from what the poses around it and the gyro say, and how fast it turns. Beyond a gap of
// the gyro its integral begins anew, so that turns of two stretches must not be compared.
struct Departures {
  std::vector<std::size_t> pose;
  std::vector<Eigen::Quaterniond> turn;  // of the pose against the integrated gyro
  std::vector<double> rad, rate_rad_s;
};

// Median of the turns from `from` to `end`, against that at `origin`.
Eigen::Vector3d median_turn(const std::vector<Eigen::Quaterniond>& turn, std::size_t from, std::size_t end, std::size_t origin) {
  const std::size_t stride = std::max<std::size_t>(1, (end - from) / kWindowPoses);
  std::vector<double> axis[3];
  for (std::size_t j = from; j < end; j += stride) {
    const Eigen::Vector3d v = log_q(turn[j] * turn[origin].conjugate());
    for (Eigen::Index k = 0; k < 3; ++k) axis[k].push_back(v[k]);
  }
  return {median(axis[0]), median(axis[1]), median(axis[2])};
}

Departures departures_of(const FlightRecord& r, const GyroStretch& s, const GyroFit& fit) {
  const GyroTurn gyro(r.gyro_B_rad_s, s, fit);
  Departures out;
  for (std::size_t i = s.first; i < s.end; ++i) {
    const double t = r.pose.t_s[i] - fit.late_s;
    if (!gyro.covers(t)) continue;
    out.pose.push_back(i);
    out.turn.push_back(r.pose.value[i].q_WS * gyro.attitude(t).conjugate());
    out.rate_rad_s.push_back(gyro.rate_rad_s(t).norm());
  }
  const auto half = static_cast<std::size_t>(std::max(1.0, std::round(kHalfWindow_s / period_s(r.pose))));
  for (std::size_t i = 0; i < out.pose.size(); ++i)
    out.rad.push_back(median_turn(out.turn, i > half ? i - half : 0, std::min(out.pose.size(), i + half + 1), i).norm());
  return out;
}

// Poses before `first` and behind `last` stand alike against the gyro: not so where the axes turn and stay turned.
bool comes_back(const Departures& d, std::size_t first, std::size_t last, std::size_t half, double departure_rad) {
  if (first == 0 || last + 1 == d.pose.size()) return true;
  const Eigen::Vector3d before = median_turn(d.turn, first > half ? first - half : 0, first, first);
  const Eigen::Vector3d after = median_turn(d.turn, last + 1, std::min(d.turn.size(), last + 1 + half), first);
  return (before - after).norm() < kReturns * departure_rad;
}

// Does a second of poses stand turned against the second before it? Then the fit of the gyro is a mean of two, and says nothing of either.
bool stays_turned(const Departures& d, std::size_t half) {
  for (std::size_t i = 2 * half; i + 2 * half < d.pose.size(); i += std::max<std::size_t>(1, half / 5))
    if ((median_turn(d.turn, i, i + 2 * half, i) - median_turn(d.turn, i - 2 * half, i, i)).norm() > kStaysTurned_rad) return true;
  return false;
}

// A log that repeats its last pose is as late as it repeats; nine tenths of the repeats are shorter.
double usual_repeat_s(const Stream<PoseReading>& pose) {
  std::vector<double> between;
  double last = pose.t_s.front();
  for (std::size_t i = 1; i < pose.size(); ++i) {
    if (pose.value[i].q_WS.coeffs() == pose.value[i - 1].q_WS.coeffs()) continue;
    between.push_back(pose.t_s[i] - last);
    last = pose.t_s[i];
  }
  return between.empty() ? 0.0 : std::max(0.0, quantile(std::move(between), 0.9) - period_s(pose));
}

// What four fifths of the poses keep within, over all stretches: a short one may be a burst for the most part.
double usual_departure_rad(const std::vector<Departures>& stretches) {
  std::vector<double> all;
  for (const Departures& d : stretches) all.insert(all.end(), d.rad.begin(), d.rad.end());
  return quantile(std::move(all), 1.0 - kMostBursts);
}

// Marks the poses of bursts; returns the largest departure of one.
double mark_bursts(const Stream<PoseReading>& pose, const Departures& d, double usual_rad, std::vector<char>& burst) {
  const double late_s = usual_repeat_s(pose) + kStampJitter_s;
  const auto beyond = [&](std::size_t k, double least_rad, double multiple) {
    return d.rad[k] > std::max(least_rad, multiple * usual_rad) + late_s * d.rate_rad_s[k];
  };
  const auto half = static_cast<std::size_t>(std::max(1.0, std::round(0.5 * kHalfWindow_s / period_s(pose))));
  double largest_rad = 0.0;
  for (std::size_t k = 0; k < d.pose.size(); ++k) {
    if (!beyond(k, kLeastBurst_rad, kBurstMultiple)) continue;
    std::size_t first = k, last = k;
    while (first > 0 && d.pose[first - 1] + 1 == d.pose[first] && beyond(first - 1, kLeastAtEnds_rad, kAtEndsMultiple)) --first;
    while (last + 1 < d.pose.size() && d.pose[last + 1] == d.pose[last] + 1 && beyond(last + 1, kLeastAtEnds_rad, kAtEndsMultiple)) ++last;
    const TimeRange range{pose.t_s[d.pose[first]], pose.t_s[d.pose[last]]};
    const double departure_rad =
        *std::max_element(d.rad.begin() + static_cast<std::ptrdiff_t>(first), d.rad.begin() + static_cast<std::ptrdiff_t>(last) + 1);
    if (range.span_s() <= kLongestBurst_s && comes_back(d, first, last, half, departure_rad)) {
      for (std::size_t i = 0; i < pose.size(); ++i)
        if (pose.t_s[i] >= range.from_s - kBesideBurst_s && pose.t_s[i] <= range.to_s + kBesideBurst_s) burst[i] = 1;
      largest_rad = std::max(largest_rad, departure_rad);
    }
    k = last;
  }
  return largest_rad;
}

}  // namespace

void check_bursts(CheckState& s) {
  Stream<PoseReading>& pose = s.record.pose;
  const auto fit = fitted_gyro(s.record);
  if (!fit) return;
  std::vector<Departures> departures;
  for (const GyroStretch& stretch : gyro_stretches(s.record, fit->late_s)) departures.push_back(departures_of(s.record, stretch, *fit));
  std::erase_if(departures, [](const Departures& d) { return d.pose.empty(); });
  const auto half = static_cast<std::size_t>(std::max(1.0, std::round(kHalfWindow_s / period_s(pose))));
  if (departures.empty() || std::any_of(departures.begin(), departures.end(), [&](const Departures& d) { return stays_turned(d, half); }))
    return;
  const double usual_rad = usual_departure_rad(departures);
  std::vector<char> burst(pose.size(), 0);
  double largest_rad = 0.0;
  for (const Departures& d : departures) largest_rad = std::max(largest_rad, mark_bursts(pose, d, usual_rad, burst));
  const auto count = std::count(burst.begin(), burst.end(), char{1});
  if (count == 0 || static_cast<double>(count) > kMostBursts * static_cast<double>(pose.size())) return;
  const std::vector<TimeRange> found = stretches(pose.t_s, burst, 1.5 * period_s(pose));
  const auto longest =
      std::max_element(found.begin(), found.end(), [](const TimeRange& a, const TimeRange& b) { return a.span_s() < b.span_s(); });
  s.exclude(
      stream_name::pose,
      fmt::format("{} bursts of at most {:.2f} s, {:.1f} % of the poses: the attitude leaves what the gyro says by up to {:.2f} rad "
                  "and comes back (likely: motion capture that lost or exchanged markers, or a gyro whose readings came late)",
                  found.size(), longest->span_s(), 100.0 * static_cast<double>(count) / static_cast<double>(pose.size()), largest_rad),
      {found.front().from_s, found.back().to_s});
  std::vector<char> keep(burst.size());
  std::transform(burst.begin(), burst.end(), keep.begin(), [](char b) { return static_cast<char>(!b); });
  pose = kept(pose, keep);
}

}  // namespace rotorloop::log
