// Resampling of polars onto the solve's grid.
#include "sim/rotor/section_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"

namespace rotorloop::sim {

double angle_of_direction_deg(double p) {
  // Undo p: on each side |X| = 1 - |Y| with |X| + |Y| = 1.
  const double q = p > 1.0 ? 2.0 - p : (p < -1.0 ? -2.0 - p : p);
  const double x = (p > 1.0 || p < -1.0) ? -(1.0 - std::abs(q)) : 1.0 - std::abs(q);
  if (p >= 2.0) return 180.0;
  if (p <= -2.0) return -180.0;
  return atan2_exact(q, x) * 180.0 / std::numbers::pi;
}

SectionTable prepare_section(const Polar& a, const Polar& b, double weight) {
  SectionTable t;
  t.reynolds_min = std::min(a.tables.front().reynolds, b.tables.front().reynolds);
  const double top = std::max(a.tables.back().reynolds, b.tables.back().reynolds);
  // One Reynolds number only: rows a unit apart, all alike.
  t.reynolds_step = std::max((top - t.reynolds_min) / (SectionTable::kRows - 1), 1.0);
  t.nodes.reserve(static_cast<std::size_t>(SectionTable::kRows) * (SectionTable::kDirections + 1));
  for (int i = 0; i < SectionTable::kRows; ++i) {
    const double reynolds = t.reynolds_min + i * t.reynolds_step;
    for (int j = 0; j <= SectionTable::kDirections; ++j) {
      const double alpha_deg = angle_of_direction_deg(-2.0 + 4.0 * j / SectionTable::kDirections);
      const auto ca = polar_at(a, alpha_deg, reynolds), cb = polar_at(b, alpha_deg, reynolds);
      t.nodes.push_back(ClCd{ca.cl + weight * (cb.cl - ca.cl), ca.cd + weight * (cb.cd - ca.cd)});
    }
    // +-180 degrees are one node; the file allows rounding between its ends.
    t.nodes.back() = t.nodes[t.nodes.size() - 1 - SectionTable::kDirections];
  }
  return t;
}

SectionCoefficients lookup(const SectionTable& t, double p, double reynolds) {
  const double q = std::clamp((p + 2.0) * (SectionTable::kDirections / 4.0), 0.0, SectionTable::kDirections - 1e-9);
  const double s = std::clamp((reynolds - t.reynolds_min) / t.reynolds_step, 0.0, SectionTable::kRows - 1 - 1e-9);
  const int j = static_cast<int>(q), i = static_cast<int>(s);
  const ClCd *low = t.row(i) + j, *high = t.row(i + 1) + j;
  const ClCd wq = {q - j, q - j}, ws = {s - i, s - i};
  const ClCd l = low[0] + wq * (low[1] - low[0]);
  const ClCd h = high[0] + wq * (high[1] - high[0]);
  const ClCd c = l + ws * (h - l);
  return {c[0], c[1]};
}

}  // namespace rotorloop::sim
