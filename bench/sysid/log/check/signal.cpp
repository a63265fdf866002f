// Uniform-grid tools of the checks; see signal.hpp.
#include "bench/sysid/log/check/signal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/error.hpp"

namespace rotorloop::log {
namespace {

// One pass of the filter, started in the steady state of its first value so that an offset makes no transient.
void butterworth_pass(std::vector<double>& v, double dt_s, double corner_hz) {
  const double k = std::tan(std::numbers::pi * corner_hz * dt_s);
  const double norm = 1.0 / (1.0 + std::numbers::sqrt2 * k + k * k);
  const double b0 = k * k * norm;
  const double a1 = 2.0 * (k * k - 1.0) * norm;
  const double a2 = (1.0 - std::numbers::sqrt2 * k + k * k) * norm;
  double x1 = v.front(), x2 = v.front(), y1 = v.front(), y2 = v.front();
  for (double& x : v) {
    const double y = b0 * (x + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
    x2 = x1;
    x1 = x;
    y2 = y1;
    y1 = y;
    x = y;
  }
}

}  // namespace

std::size_t Grid::nearest(double t) const {
  if (count == 0) return 0;
  const double i = std::round((t - t0_s) / dt_s);
  return static_cast<std::size_t>(std::clamp(i, 0.0, static_cast<double>(count - 1)));
}

Grid grid_over(TimeRange range, double dt_s) {
  if (!(range.span_s() <= kLongestFlight_s))
    throw Error({fmt::format("grid from {:.6g} to {:.6g} s", range.from_s, range.to_s),
                 fmt::format("spans {:.4g} s (allowed {:.4g} s)", range.span_s(), kLongestFlight_s), "time unit, or a wild stamp",
                 "give the unit of time in the mapping; cut the log to one flight"},
                ExitCode::data_quality);
  Grid g{.t0_s = range.from_s, .dt_s = dt_s, .count = 0};
  if (range.span_s() > 0.0) g.count = static_cast<std::size_t>(range.span_s() / dt_s) + 1;
  return g;
}

std::vector<double> on_grid(std::span<const double> t, std::span<const double> value, const Grid& grid) {
  std::vector<double> out(grid.count);
  std::size_t next = 0;
  for (std::size_t i = 0; i < grid.count; ++i) {
    const double at = grid.t_s(i);
    while (next < t.size() && t[next] <= at) ++next;
    if (next == 0) {
      out[i] = value.front();
    } else if (next == t.size()) {
      out[i] = value.back();
    } else {
      const double f = (at - t[next - 1]) / (t[next] - t[next - 1]);
      out[i] = value[next - 1] + f * (value[next] - value[next - 1]);
    }
  }
  return out;
}

std::vector<char> covered(std::span<const double> t, const Grid& grid, double reach_s) {
  std::vector<char> out(grid.count, 0);
  std::size_t next = 0;
  for (std::size_t i = 0; i < grid.count; ++i) {
    const double at = grid.t_s(i);
    while (next < t.size() && t[next] <= at) ++next;
    const bool before = next > 0 && at - t[next - 1] <= reach_s;
    const bool after = next < t.size() ? t[next] - at <= reach_s : (next > 0 && t[next - 1] == at);
    out[i] = before && after;
  }
  return out;
}

std::vector<char> shrunk(const std::vector<char>& mask, double dt_s, double margin_s) {
  const auto margin = static_cast<std::size_t>(std::ceil(margin_s / dt_s));
  std::vector<char> out = mask;
  const std::size_t n = mask.size();
  for (std::size_t i = 0, since = margin + 1; i < n; ++i) {  // points since the last 0
    since = mask[i] ? since + 1 : 0;
    if (since <= margin) out[i] = 0;
  }
  for (std::size_t i = n, until = margin + 1; i-- > 0;) {
    until = mask[i] ? until + 1 : 0;
    if (until <= margin) out[i] = 0;
  }
  return out;
}

std::vector<double> low_pass(std::vector<double> v, double dt_s, double corner_hz) {
  if (v.size() < 3) return v;
  butterworth_pass(v, dt_s, corner_hz);
  std::reverse(v.begin(), v.end());
  butterworth_pass(v, dt_s, corner_hz);
  std::reverse(v.begin(), v.end());
  return v;
}

std::vector<double> derivative(const std::vector<double>& v, double dt_s) {
  std::vector<double> d(v.size(), 0.0);
  if (v.size() < 2) return d;
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::size_t a = i > 0 ? i - 1 : 0, b = std::min(i + 1, v.size() - 1);
    d[i] = (v[b] - v[a]) / (dt_s * static_cast<double>(b - a));
  }
  return d;
}

std::vector<double> every(const std::vector<double>& v, std::size_t step) {
  std::vector<double> out;
  out.reserve(v.size() / step + 1);
  for (std::size_t i = 0; i < v.size(); i += step) out.push_back(v[i]);
  return out;
}

std::vector<TimeRange> stretches(std::span<const double> t, const std::vector<char>& flag, double join_s) {
  std::vector<TimeRange> out;
  for (std::size_t i = 0; i < flag.size(); ++i) {
    if (!flag[i]) continue;
    if (!out.empty() && t[i] - out.back().to_s <= join_s) {
      out.back().to_s = t[i];
    } else {
      out.push_back({t[i], t[i]});
    }
  }
  return out;
}

std::vector<TimeRange> joined(std::vector<TimeRange> ranges, double join_s) {
  std::sort(ranges.begin(), ranges.end(), [](const TimeRange& a, const TimeRange& b) { return a.from_s < b.from_s; });
  std::vector<TimeRange> out;
  for (const TimeRange& r : ranges) {
    if (!out.empty() && r.from_s - out.back().to_s <= join_s) {
      out.back().to_s = std::max(out.back().to_s, r.to_s);
    } else {
      out.push_back(r);
    }
  }
  return out;
}

std::vector<TimeRange> remaining(TimeRange whole, const std::vector<TimeRange>& holes, double shortest_s) {
  std::vector<TimeRange> out;
  double from = whole.from_s;
  const auto keep = [&](double to) {
    if (to - from >= shortest_s) out.push_back({from, to});
  };
  for (const TimeRange& h : joined(holes, 0.0)) {
    if (h.to_s < whole.from_s || h.from_s > whole.to_s) continue;
    keep(h.from_s);
    from = std::max(from, h.to_s);
  }
  keep(whole.to_s);
  return out;
}

}  // namespace rotorloop::log
