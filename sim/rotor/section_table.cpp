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

namespace {
constexpr int kNodes = SectionTable::kDirections + 1;

// Angle of zero lift: the crossing met first on the way down from 10 degrees; a section without one gets no stall delay.
double zero_lift_deg(const ClCd* row, const std::vector<double>& alpha_deg) {
  for (int j = kNodes - 1; j > 0; --j) {
    const auto k = static_cast<std::size_t>(j);
    if (alpha_deg[k] > 10.0 || row[j][0] < 0.0 || row[j - 1][0] > 0.0) continue;
    const double rise = row[j][0] - row[j - 1][0];
    return rise > 0.0 ? alpha_deg[k] - row[j][0] / rise * (alpha_deg[k] - alpha_deg[k - 1]) : alpha_deg[k];
  }
  return kSnelEnd_deg;
}

void delay_stall(ClCd* row, const std::vector<double>& alpha_deg, double share, double with_drag) {
  const double zero_deg = zero_lift_deg(row, alpha_deg);
  for (int j = 0; j < kNodes; ++j) {
    const double alpha = alpha_deg[static_cast<std::size_t>(j)];
    if (alpha <= zero_deg || alpha >= kSnelEnd_deg) continue;
    const double fade = std::min(1.0, (kSnelEnd_deg - alpha) / (kSnelEnd_deg - kSnelFullTo_deg));
    const double potential = 2.0 * std::numbers::pi * sin_exact((alpha - zero_deg) * std::numbers::pi / 180.0);
    const double gain = share * fade * std::max(0.0, potential - row[j][0]);
    row[j][0] += gain;
    if (with_drag > 0.0 && alpha > 0.0) {
      const SinCos a = sincos_exact(alpha * std::numbers::pi / 180.0);
      row[j][1] += with_drag * gain * a.sin / a.cos;
    }
  }
}
}  // namespace

SectionTable prepare_section(const Polar& a, const Polar& b, double weight, SectionCorrection correction) {
  SectionTable t;
  t.reynolds_min = std::min(a.tables.front().reynolds, b.tables.front().reynolds);
  const double top = std::max(a.tables.back().reynolds, b.tables.back().reynolds);
  // One Reynolds number only: rows a unit apart, all alike.
  t.reynolds_step = std::max((top - t.reynolds_min) / (SectionTable::kRows - 1), 1.0);
  std::vector<double> alpha_deg;
  for (int j = 0; j < kNodes; ++j) alpha_deg.push_back(angle_of_direction_deg(-2.0 + 4.0 * j / SectionTable::kDirections));
  t.nodes.reserve(static_cast<std::size_t>(SectionTable::kRows) * SectionTable::kStride);
  for (int i = 0; i < SectionTable::kRows; ++i) {
    const double reynolds = t.reynolds_min + i * t.reynolds_step;
    for (const double alpha : alpha_deg) {
      const auto ca = polar_at(a, alpha, reynolds), cb = &a == &b ? ca : polar_at(b, alpha, reynolds);
      t.nodes.push_back(ClCd{ca.cl + weight * (cb.cl - ca.cl), correction.drag_scale * (ca.cd + weight * (cb.cd - ca.cd))});
    }
    ClCd* row = t.nodes.data() + static_cast<std::ptrdiff_t>(i) * SectionTable::kStride;
    row[kNodes - 1] = row[0];  // +-180 degrees are one direction; the file allows rounding between its ends
    t.nodes.resize(static_cast<std::size_t>(i + 1) * SectionTable::kStride);
    delay_stall(row, alpha_deg, correction.stall_delay_share, correction.stall_drag);
    for (int j = 0; j < kNodes; ++j) row[j][0] *= correction.lift_scale;
    row[kNodes] = row[kNodes - 1];
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
