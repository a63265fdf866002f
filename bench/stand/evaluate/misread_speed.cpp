#include "bench/stand/evaluate/misread_speed.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/constants.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::stand {
namespace {

constexpr std::size_t kFewestPoints = 6;
constexpr std::size_t kMostForLine = 150;     // of a record with thousands: the line is through every so-many-th
const double kBothChannels = std::log(1.35);  // of y/ω², so 16 % of the speed; fans with Reynolds number and mount differ by less
const double kOneChannel = std::log(1.8);     // without a second channel a gust looks alike
constexpr double kRobustDeviations = 6.0;
constexpr double kZero = 0.02, kZeroUnknown = 0.05;  // of the largest reading: what a zero may be off, with and without readings at rest
constexpr double kMostMisread = 0.25;
constexpr std::size_t kMostNamed = 8;
constexpr double kWithoutWind_m_s = 0.5;

// d = ln(y/ω²) less a robust line over ln ω, and what is allowed for it; not-a-number where the channel has no reading. Of a reading
// no larger than what its zero may be off only that bound is known: d is 0 where the shown speed asks for no more, else not known.
struct Stray {
  double away = kNotMeasured, allowed = 0.0;
};

// Line by the median of all slopes and of all offsets (Theil 1950, Sen 1968): 29 % of the points may be anywhere.
std::vector<Stray> strays(const StandRecord& r, double StandPoint::*value, double rest) {
  std::vector<Stray> out(r.points.size());
  std::vector<std::size_t> use, small;
  std::vector<double> x(r.points.size()), y(r.points.size());
  double largest = 0.0;
  for (const StandPoint& p : r.points)
    if (p.*value == p.*value) largest = std::max(largest, std::abs(p.*value));
  const double zero = rest == rest ? rest : 0.0, share = rest == rest ? kZero : kZeroUnknown;
  for (std::size_t i = 0; i < r.points.size(); ++i) {
    const double w = r.points[i].omega_rad_s[0], v = r.points[i].*value - zero;
    if (!(w > 0.0) || v != v || r.points[i].airspeed_m_s > kWithoutWind_m_s) continue;
    x[i] = std::log(w);
    y[i] = std::log(std::max(std::abs(v), share * largest) / (w * w));
    (std::abs(v) > share * largest ? use : small).push_back(i);
  }
  if (use.size() < kFewestPoints) return out;
  std::vector<double> slopes, offsets, away;
  const std::size_t stride = (use.size() + kMostForLine - 1) / kMostForLine;
  for (std::size_t a = 0; a < use.size(); a += stride)
    for (std::size_t b = a + stride; b < use.size(); b += stride)
      if (const double dx = x[use[b]] - x[use[a]]; std::abs(dx) > 0.02) slopes.push_back((y[use[b]] - y[use[a]]) / dx);
  const double slope = slopes.empty() ? 0.0 : median(slopes);
  for (const std::size_t i : use) offsets.push_back(y[i] - slope * x[i]);
  const double offset = median(offsets);
  for (const double o : offsets) away.push_back(o - offset);
  const double scatter = kRobustDeviations * robust_deviation(away);
  for (std::size_t k = 0; k < use.size(); ++k) {
    const double v = std::abs(r.points[use[k]].*value - zero);
    out[use[k]] = {away[k], scatter + share * largest / v};
  }
  for (const std::size_t i : small)
    if (y[i] - slope * x[i] >= offset) out[i].away = 0.0;
  return out;
}

}  // namespace

void check_misread_speed(CheckedStand& s) {
  StandRecord& r = s.record;
  if (r.rotors != 1) return;
  const auto thrust = strays(r, &StandPoint::thrust_N, s.rest_thrust_N), torque = strays(r, &StandPoint::torque_N_m, s.rest_torque_N_m);
  std::vector<char> misread(r.points.size(), 0);
  std::size_t judged = 0;
  std::vector<std::string> named;
  for (std::size_t i = 0; i < r.points.size(); ++i) {
    const Stray &t = thrust[i], &q = torque[i];
    const bool has_t = t.away == t.away, has_q = q.away == q.away;
    judged += has_t || has_q;
    const auto beyond = [](const Stray& x, double least) { return std::abs(x.away) > std::max(least, x.allowed); };
    misread[i] = has_t && has_q   ? beyond(t, kBothChannels) && beyond(q, kBothChannels) && t.away * q.away > 0.0
                 : has_t || has_q ? beyond(has_t ? t : q, kOneChannel)
                                  : false;
    if (!misread[i]) continue;
    const double factor = std::exp(-0.5 * (has_t && has_q ? 0.5 * (t.away + q.away) : has_t ? t.away : q.away));
    named.push_back(fmt::format("row {} ({:.0f} RPM, {:.2f} times what its {} fit)", r.points[i].row,
                                r.points[i].omega_rad_s[0] * kRpm_per_rad_s, factor,
                                has_t && has_q ? "thrust and torque"
                                : has_t        ? "thrust"
                                               : "torque"));
  }
  if (named.empty()) return;
  const std::size_t count = named.size();
  const std::string list =
      fmt::format("{}{}", fmt::join(named.begin(), named.begin() + static_cast<std::ptrdiff_t>(std::min(count, kMostNamed)), ", "),
                  count > kMostNamed ? fmt::format(" and {} more", count - kMostNamed) : "");
  if (static_cast<double>(count) > kMostMisread * static_cast<double>(judged)) {
    s.speed = StandChannelState::faulty;
    s.faults.push_back(
        {"rotor speed",
         fmt::format("does not fit thrust and torque in {} of {} points (allowed {:.0f} %): {}", count, judged, 100.0 * kMostMisread, list),
         "the sensor counts marks twice or misses some, or the pole pairs changed"});
    return;
  }
  std::size_t k = 0;
  std::erase_if(r.points, [&](const StandPoint&) { return misread[k++] != 0; });
  s.notes.push_back(fmt::format(
      "{} of {} points left out, their speed does not fit: {}; likely the sensor counted marks twice or missed some", count, judged, list));
}

}  // namespace rotorloop::stand
