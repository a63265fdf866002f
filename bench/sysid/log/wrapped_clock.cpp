#include "bench/sysid/log/wrapped_clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace rotorloop::log {
namespace {

// Counters of 32 bits start anew at 2^32: 71.6 minutes of microseconds. A step back by nearly all of that, with a usual step beyond it, is
// no clock that was set back. Returns how often it happened.
std::size_t unwrap(std::vector<double>& t) {
  constexpr double kWrap = 4294967296.0, kNearEnd = 0.01;  // of the counter: no step of a log is longer
  const bool counter = std::all_of(t.begin(), t.end(), [](double x) { return !(x == x) || (x >= 0.0 && x < kWrap && x == std::floor(x)); });
  if (!counter) return 0;
  std::size_t times = 0;
  double before = std::numeric_limits<double>::quiet_NaN();
  for (double& x : t) {
    if (!(x == x)) continue;
    const double raw = x;
    if (before - raw > (1.0 - kNearEnd) * kWrap) ++times;
    before = raw;
    x = raw + static_cast<double>(times) * kWrap;
  }
  return times;
}

}  // namespace

void unwrap_clocks(const LogMapping& m, std::vector<std::optional<ColumnTable>>& tables, std::vector<LogFinding>& findings) {
  double first_of_wrapped = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::size_t> steady;
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const MappedTime& clock = m.sources[i].time;
    if (!tables[i] || !tables[i]->has(clock.column) || clock.s_per_unit == 1.0) continue;
    std::vector<double>& t = tables[i]->columns.at(clock.column);
    if (const std::size_t times = unwrap(t); times > 0) {
      first_of_wrapped = t.front();
      findings.push_back({"log",
                          fmt::format("{}: the clock \"{}\" of 32 bits starts anew {} time{}; read on beyond it", tables[i]->label,
                                      clock.column, times, times == 1 ? "" : "s"),
                          0.0, 0.0, FindingAction::note});
    } else if (!t.empty()) {
      steady.push_back(i);
    }
  }
  for (const std::size_t i : steady)
    if (auto& t = tables[i]->columns.at(m.sources[i].time.column); first_of_wrapped - t.front() > 2147483648.0)
      for (double& x : t) x += 4294967296.0;  // it begins behind the wrap of the others
}

}  // namespace rotorloop::log
