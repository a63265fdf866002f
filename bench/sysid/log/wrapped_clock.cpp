#include "bench/sysid/log/wrapped_clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace rotorloop::log {
namespace {

// A counter of 2^bits ticks starts anew at its end, in whatever unit the log has written it.
struct Counter {
  double period_s;
  bool any_step;  // steps up to 1 % of the period may lead over its end; else those that the log makes everywhere
  const char* what;
};
constexpr std::array kCounters{Counter{4294.967296, true, "microseconds of 32 bits"}, Counter{4294967.296, true, "milliseconds of 32 bits"},
                               Counter{65.536, false, "milliseconds of 16 bits"}, Counter{4.294967296, false, "nanoseconds of 32 bits"}};

// How often the clock starts anew at `period`, read on beyond it; 0, and nothing changed, where it does not, or where a step back is not
// one by nearly all of the counter: that is a clock that was set back.
std::size_t unwrap(std::vector<double>& t, double period, double longest) {
  std::size_t times = 0;
  double before = std::numeric_limits<double>::quiet_NaN(), low = HUGE_VAL, high = -HUGE_VAL;
  for (const double x : t) {
    if (!(x == x)) continue;
    low = std::min(low, x);
    high = std::max(high, x);
    if (x < before) {
      ++times;
      if (!(x + period - before > 0.0 && x + period - before <= longest)) return 0;
    }
    before = x;
  }
  if (times == 0 || high - low >= period) return 0;
  double turns = 0.0;
  before = std::numeric_limits<double>::quiet_NaN();
  for (double& x : t) {
    if (!(x == x)) continue;
    if (x < before) turns += 1.0;
    before = x;
    x += turns * period;
  }
  return times;
}

// The usual step of a clock, not-a-number without one.
double usual_step(const std::vector<double>& t) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < t.size(); ++i)
    if (t[i] > t[i - 1]) steps.push_back(t[i] - t[i - 1]);
  if (steps.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  return steps[steps.size() / 2];
}

}  // namespace

void unwrap_clocks(const LogMapping& m, std::vector<std::optional<ColumnTable>>& tables, std::vector<LogFinding>& findings) {
  constexpr double kUsual = 5.0, kNearEnd = 0.01;
  double first_s = std::numeric_limits<double>::quiet_NaN(), period_s = 0.0;  // of a clock that wraps
  std::vector<std::size_t> steady;
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const MappedTime& clock = m.sources[i].time;
    if (!tables[i] || !tables[i]->has(clock.column)) continue;
    std::vector<double>& t = tables[i]->columns.at(clock.column);
    std::size_t times = 0;
    for (const Counter& c : kCounters) {
      const double period = c.period_s / clock.s_per_unit;
      times = unwrap(t, period, c.any_step ? kNearEnd * period : kUsual * usual_step(t));
      if (times == 0) continue;
      first_s = t.front() * clock.s_per_unit;
      period_s = c.period_s;
      findings.push_back({"log",
                          fmt::format("{}: the clock \"{}\", {}, starts anew {} time{}; read on beyond it", tables[i]->label, clock.column,
                                      c.what, times, times == 1 ? "" : "s"),
                          0.0, 0.0, FindingAction::note});
      break;
    }
    if (times == 0 && !t.empty()) steady.push_back(i);
  }
  for (const std::size_t i : steady) {
    const MappedTime& clock = m.sources[i].time;
    if (auto& t = tables[i]->columns.at(clock.column); first_s - t.front() * clock.s_per_unit > 0.5 * period_s)
      for (double& x : t) x += period_s / clock.s_per_unit;  // it begins behind the wrap of the others
  }
}

}  // namespace rotorloop::log
