// Streams with clocks of their own, laid side by side: for writers of formats that have rows or messages of several quantities.
#pragma once
#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace rotorloop::log {

inline constexpr std::size_t kNoRow = std::numeric_limits<std::size_t>::max();

// One row for each distinct stamp, in order of time; a stamp that one stream has twice makes two rows.
struct MergedRow {
  double t_s = 0.0;
  std::vector<std::size_t> index;  // into each stream; kNoRow where it has nothing at this time
};

inline std::vector<MergedRow> merged_rows(const std::vector<const std::vector<double>*>& stamps) {
  std::vector<std::vector<std::size_t>> order(stamps.size());
  for (std::size_t k = 0; k < stamps.size(); ++k) {
    const auto& t = *stamps[k];
    order[k].resize(t.size());
    for (std::size_t i = 0; i < t.size(); ++i) order[k][i] = i;
    std::stable_sort(order[k].begin(), order[k].end(), [&](std::size_t a, std::size_t b) { return t[a] < t[b]; });
  }
  std::vector<std::size_t> next(stamps.size(), 0);
  std::vector<MergedRow> rows;
  for (;;) {
    double t = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < stamps.size(); ++k)
      if (next[k] < order[k].size()) t = std::min(t, (*stamps[k])[order[k][next[k]]]);
    if (t == std::numeric_limits<double>::infinity()) return rows;
    MergedRow row{t, std::vector<std::size_t>(stamps.size(), kNoRow)};
    for (std::size_t k = 0; k < stamps.size(); ++k)
      if (next[k] < order[k].size() && (*stamps[k])[order[k][next[k]]] == t) row.index[k] = order[k][next[k]++];
    rows.push_back(std::move(row));
  }
}

}  // namespace rotorloop::log
