#include "bench/stand/run/sample_grid.hpp"

#include <algorithm>
#include <limits>

namespace rotorloop::stand_run {

SampleGrid::SampleGrid(std::vector<GridColumn> columns, std::int64_t period_ns, std::int64_t patience_ns)
    : columns_(std::move(columns)), points_(columns_.size()), period_ns_(period_ns), patience_ns_(patience_ns) {}

void SampleGrid::add(std::size_t column, std::int64_t t_ns, double value) {
  auto& p = points_[column];
  const std::int64_t true_ns = t_ns - columns_[column].lag_ns;
  if (!p.empty() && true_ns <= p.back().t_ns) return;
  p.push_back({true_ns, value});
}

double SampleGrid::at(std::size_t column, std::int64_t t_ns) const {
  const auto& p = points_[column];
  constexpr double kHole = std::numeric_limits<double>::quiet_NaN();
  const auto after = std::lower_bound(p.begin(), p.end(), t_ns, [](const Point& a, std::int64_t t) { return a.t_ns < t; });
  if (columns_[column].longest_gap_ns == 0) {
    if (after != p.end() && after->t_ns == t_ns) return after->value;
    return after == p.begin() ? kHole : (after - 1)->value;
  }
  if (after == p.end() || after == p.begin()) return after != p.end() && after->t_ns == t_ns ? after->value : kHole;
  const auto before = after - 1;
  if (after->t_ns - before->t_ns > columns_[column].longest_gap_ns) return kHole;
  const double share = static_cast<double>(t_ns - before->t_ns) / static_cast<double>(after->t_ns - before->t_ns);
  return before->value + share * (after->value - before->value);
}

std::vector<GridRow> SampleGrid::take(std::int64_t now_ns) {
  std::vector<GridRow> out;
  for (; next_ns_ < now_ns; next_ns_ += period_ns_) {
    bool all = true;
    for (std::size_t c = 0; c < columns_.size(); ++c)
      all = all && (columns_[c].longest_gap_ns == 0 || (!points_[c].empty() && points_[c].back().t_ns >= next_ns_));
    if (!all && now_ns - next_ns_ < patience_ns_) break;
    GridRow row{next_ns_, {}};
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      row.values.push_back(at(c, next_ns_));
      auto& p = points_[c];
      while (p.size() > 2 && p[1].t_ns < next_ns_) p.pop_front();
    }
    out.push_back(std::move(row));
  }
  return out;
}

}  // namespace rotorloop::stand_run
