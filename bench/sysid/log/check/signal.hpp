// Series on one uniform grid: how streams with clocks of their own are compared before any fit. Filters run forwards and backwards,
// so they move nothing in time; what a filter cannot know (gaps, ends) is marked, not guessed.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace rotorloop::log {

struct TimeRange {
  double from_s = 0.0, to_s = 0.0;
  double span_s() const { return to_s - from_s; }
  bool contains(double t_s) const { return t_s >= from_s && t_s <= to_s; }
};

struct Grid {
  double t0_s = 0.0, dt_s = 0.0;
  std::size_t count = 0;
  double t_s(std::size_t i) const { return t0_s + dt_s * static_cast<double>(i); }
  std::size_t nearest(double t_s) const;  // clamped to the grid
};

inline constexpr double kLongestFlight_s = 4.0 * 3600.0;  // more is a wrong unit or a wild stamp, and more memory than there is
// Throws Error (ExitCode::data_quality) for a range that is no number or longer than that.
Grid grid_over(TimeRange range, double dt_s);

// Linear interpolation at the grid's times; the end values are held. Stamps ascending, at least one sample.
std::vector<double> on_grid(std::span<const double> t_s, std::span<const double> value, const Grid& grid);
// 1 where a sample stands within `reach_s` on both sides, else 0.
std::vector<char> covered(std::span<const double> t_s, const Grid& grid, double reach_s);
// `mask` without the points closer than `margin_s` to one that is 0.
std::vector<char> shrunk(const std::vector<char>& mask, double dt_s, double margin_s);

// Butterworth of second order run forwards and backwards: no phase, half power twice over at the corner.
std::vector<double> low_pass(std::vector<double> v, double dt_s, double corner_hz);
std::vector<double> derivative(const std::vector<double>& v, double dt_s);  // central; one-sided at the ends
// Every `step`-th point, after low_pass: the corner must be well below the new rate.
std::vector<double> every(const std::vector<double>& v, std::size_t step);

// The stretches where `flag` is set on the grid of `t_s`, joined when closer than `join_s`.
std::vector<TimeRange> stretches(std::span<const double> t_s, const std::vector<char>& flag, double join_s);
std::vector<TimeRange> joined(std::vector<TimeRange> ranges, double join_s);
// What is left of `whole` without `holes`, parts of at least `shortest_s`.
std::vector<TimeRange> remaining(TimeRange whole, const std::vector<TimeRange>& holes, double shortest_s);

}  // namespace rotorloop::log
