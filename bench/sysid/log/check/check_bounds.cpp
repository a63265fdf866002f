// Values that no flight shows in any unit, and speeds with a sign: taken out or refused before a filter spreads them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "bench/sysid/log/check/check_steps.hpp"
#include "bench/sysid/log/check/stream_access.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::log {
namespace {

// Far above what a vehicle does. Where more than a few samples are beyond, the unit is wrong and later checks name it; where they are
// beyond kNoUnit, no unit explains them.
struct Bound {
  const char* stream;
  double most;
  const char* unit;
};
constexpr Bound kBounds[] = {
    {stream_name::pose, 1e5, "m"},         {stream_name::position, 1e5, "m"},
    {stream_name::velocity, 300.0, "m/s"}, {stream_name::gyro, 150.0, "rad/s"},  // 8600 deg/s; gyros end at 4000
    {stream_name::accel, 2000.0, "m/s^2"},                                       // 200 g
    {stream_name::rotors, 2e4, "rad/s"},                                         // 190 000 rev/min
    {stream_name::command, 1e4, ""},       {stream_name::battery, 1e3, "V"},
};
constexpr double kNoUnit = 1e9, kMostBeyond = 0.1;

template <class Value>
void check_bound(CheckState& s, const std::string& name, Stream<Value>& stream) {
  const auto* bound = std::find_if(std::begin(kBounds), std::end(kBounds), [&](const Bound& b) { return name == b.stream; });
  if (bound == std::end(kBounds)) return;
  std::vector<char> beyond(stream.size(), 0);
  double worst = 0.0;
  std::size_t count = 0, absurd = 0;
  for (std::size_t i = 0; i < stream.size(); ++i) {
    double largest = 0.0;
    for (const double v : channels_of(stream.value[i]))
      if (std::abs(v) > std::abs(largest)) largest = v;
    if (std::abs(largest) <= bound->most) continue;
    beyond[i] = 1;
    ++count;
    absurd += std::abs(largest) > kNoUnit;
    if (std::abs(largest) > std::abs(worst)) worst = largest;
  }
  if (count == 0) return;
  const TimeRange range = stretches(stream.t_s, beyond, HUGE_VAL).front();
  const std::string what = fmt::format("{} of {} samples are beyond what a flight shows, up to {:.3g} {} (allowed {:.3g} to {:.3g})", count,
                                       stream.size(), worst, bound->unit, -bound->most, bound->most);
  if (static_cast<double>(absurd) > kMostBeyond * static_cast<double>(stream.size())) {
    s.refuse(name, what, range, "a damaged column, or one that holds something else", "repair the log, or name the right column");
    return;
  }
  if (static_cast<double>(count) > kMostBeyond * static_cast<double>(stream.size())) return;  // the unit: named by later checks
  s.exclude(name, what, range);
  for (char& b : beyond) b = !b;
  stream = kept(stream, beyond);
}

void check_speed_sign(CheckState& s) {
  const auto& w = s.record.rotor_omega_rad_s;
  std::string which, values;
  for (std::size_t k = 0; k < 4 && !w.empty(); ++k) {
    const double usual = median(channel(w, k));
    if (usual >= 0.0) continue;
    which += fmt::format("{}{}", which.empty() ? "" : ", ", k + 1);
    values += fmt::format("{}{:.4g}", values.empty() ? "" : ", ", usual);
  }
  if (which.empty()) return;
  s.refuse(stream_name::rotors, fmt::format("the speeds of rotor {} are negative: median {} rad/s (allowed 0 and above)", which, values),
           {w.t_s.front(), w.t_s.back()}, "a sign that stands for the direction of rotation",
           "give `sign` in the mapping, -1 for these rotors; in a log of rotorloop write speeds without sign");
}

// Packs of one to sixteen lithium cells, nearly empty to full. No other reading fits between their units.
void check_battery_unit(CheckState& s) {
  constexpr double kLeast_V = 2.5, kMost_V = 70.0;
  const auto& b = s.record.battery_V;
  if (b.empty()) return;
  const double usual = median(b.value);
  if (usual >= kLeast_V && usual <= kMost_V) return;
  std::string likely, units;
  for (const auto& [factor, words, unit] : {std::tuple{1e-3, "the log has mV, the mapping says V", "mV"},
                                            std::tuple{1e-2, "the log has hundredths of a volt, the mapping says V", "cV"},
                                            std::tuple{1e-1, "the log has tenths of a volt, the mapping says V", "dV"},
                                            std::tuple{1e3, "the log has V, the mapping says mV", "V"}}) {
    if (usual * factor < kLeast_V || usual * factor > kMost_V) continue;
    likely += fmt::format("{}{} (then {:.4g} V)", likely.empty() ? "" : "; or ", words, usual * factor);
    units += fmt::format("{}unit = \"{}\"", units.empty() ? "" : " or ", unit);
  }
  if (likely.empty()) return;
  s.refuse(stream_name::battery, fmt::format("the median is {:.4g} V (allowed {:.3g} to {:.3g} V)", usual, kLeast_V, kMost_V),
           {b.t_s.front(), b.t_s.back()}, likely, fmt::format("give {} in the mapping's [[stream]] of battery", units));
}

}  // namespace

void check_bounds(CheckState& s) {
  for_each_stream(s.record, [&](const std::string& name, auto& stream) { check_bound(s, name, stream); });
  if (!s.refused()) check_speed_sign(s);
  if (!s.refused()) check_battery_unit(s);
}

}  // namespace rotorloop::log
