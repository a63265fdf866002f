// Readings of several instruments, each at its own times, as rows of one time: linear between the neighbours of a channel, as long as they
// are close enough to each other. A row comes when every channel has passed it, or after `patience`, with holes for those that have not.
#pragma once
#include <cstdint>
#include <deque>
#include <vector>

namespace rotorloop::stand_run {

struct GridColumn {
  std::int64_t lag_ns = 0;          // a value shown at t was true at t - lag
  std::int64_t longest_gap_ns = 0;  // between neighbours; 0: a slow channel, its newest value stands
};

struct GridRow {
  std::int64_t t_ns = 0;
  std::vector<double> values;  // not-a-number: a hole
};

class SampleGrid {
 public:
  SampleGrid(std::vector<GridColumn> columns, std::int64_t period_ns, std::int64_t patience_ns);
  // In the order of time for each column; others are dropped.
  void add(std::size_t column, std::int64_t t_ns, double value);
  void start(std::int64_t t_ns) { next_ns_ = t_ns; }
  std::vector<GridRow> take(std::int64_t now_ns);

 private:
  struct Point {
    std::int64_t t_ns;
    double value;
  };
  double at(std::size_t column, std::int64_t t_ns) const;
  std::vector<GridColumn> columns_;
  std::vector<std::deque<Point>> points_;
  std::int64_t period_ns_, patience_ns_, next_ns_ = 0;
};

}  // namespace rotorloop::stand_run
