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

double direction(int node) { return -2.0 + 4.0 * node / SectionTable::kDirections; }

// Two polars at one Reynolds number, blended and corrected, at any angle of attack.
class Section {
 public:
  Section(const Polar& a, const Polar& b, double weight, double reynolds, SectionCorrection correction)
      : a_(a), b_(b), weight_(weight), reynolds_(reynolds), correction_(correction), zero_deg_(zero_lift_deg()) {}

  SectionCoefficients at(double alpha_deg) const {
    SectionCoefficients c = bare(alpha_deg);
    c.cd *= correction_.drag_scale;
    if (alpha_deg > zero_deg_ && alpha_deg < kSnelEnd_deg) delay_stall(alpha_deg, c);
    c.cl *= correction_.lift_scale;
    return c;
  }

 private:
  void delay_stall(double alpha_deg, SectionCoefficients& c) const {
    const double fade = std::min(1.0, (kSnelEnd_deg - alpha_deg) / (kSnelEnd_deg - kSnelFullTo_deg));
    const double potential = 2.0 * std::numbers::pi * sin_exact((alpha_deg - zero_deg_) * std::numbers::pi / 180.0);
    const double gain = correction_.stall_delay_share * fade * std::max(0.0, potential - c.cl);
    c.cl += gain;
    if (correction_.stall_drag > 0.0 && alpha_deg > 0.0) {
      const SinCos a = sincos_exact(alpha_deg * std::numbers::pi / 180.0);
      c.cd += correction_.stall_drag * gain * a.sin / a.cos;
    }
  }
  SectionCoefficients bare(double alpha_deg) const {
    const auto ca = polar_at(a_, alpha_deg, reynolds_), cb = &a_ == &b_ ? ca : polar_at(b_, alpha_deg, reynolds_);
    return {ca.cl + weight_ * (cb.cl - ca.cl), ca.cd + weight_ * (cb.cd - ca.cd)};
  }
  // Angle of zero lift: the crossing met first on the way down from 10 degrees; a section without one gets no stall delay.
  double zero_lift_deg() const {
    constexpr double kFrom_deg = 10.0, kStep_deg = 0.2, kTo_deg = -180.0;
    double above_deg = kFrom_deg, above = bare(kFrom_deg).cl;
    for (int i = 1; above_deg > kTo_deg; ++i) {
      const double below_deg = kFrom_deg - i * kStep_deg, below = bare(below_deg).cl;
      if (above >= 0.0 && below <= 0.0) return above > below ? above_deg - above / (above - below) * kStep_deg : above_deg;
      above_deg = below_deg;
      above = below;
    }
    return kSnelEnd_deg;
  }

  const Polar &a_, &b_;
  double weight_, reynolds_;
  SectionCorrection correction_;
  double zero_deg_;
};
}  // namespace

SectionTable prepare_section(const Polar& a, const Polar& b, double weight, double twist_deg, SectionCorrection correction) {
  SectionTable t;
  t.reynolds_min = std::min(a.tables.front().reynolds, b.tables.front().reynolds);
  const double top = std::max(a.tables.back().reynolds, b.tables.back().reynolds);
  // One Reynolds number only: rows a unit apart, all alike.
  t.reynolds_step = std::max((top - t.reynolds_min) / (SectionTable::kRows - 1), 1.0);
  struct Direction {
    double alpha_deg;
    SinCos inflow;
  };
  std::vector<Direction> directions;
  directions.reserve(kNodes);
  for (int j = 0; j < kNodes; ++j) {
    // +-180 degrees are one direction; the file allows rounding between its ends.
    const double inflow_deg = angle_of_direction_deg(direction(j < kNodes - 1 ? j : 0));
    double alpha_deg = twist_deg - inflow_deg;
    alpha_deg += alpha_deg > 180.0 ? -360.0 : (alpha_deg < -180.0 ? 360.0 : 0.0);
    directions.push_back({alpha_deg, sincos_exact(inflow_deg * std::numbers::pi / 180.0)});
  }
  t.nodes.reserve(static_cast<std::size_t>(SectionTable::kRows) * SectionTable::kStride);
  for (int i = 0; i < SectionTable::kRows; ++i) {
    const Section section(a, b, weight, t.reynolds_min + i * t.reynolds_step, correction);
    for (const Direction& d : directions) {
      const SectionCoefficients c = section.at(d.alpha_deg);
      t.nodes.push_back({c.cl * d.inflow.cos - c.cd * d.inflow.sin, c.cl * d.inflow.sin + c.cd * d.inflow.cos});
    }
    t.nodes.push_back(t.nodes.back());
  }
  return t;
}

SectionForce lookup(const SectionTable& t, double p, double reynolds) {
  const double q = std::clamp((p + 2.0) * (SectionTable::kDirections / 4.0), 0.0, SectionTable::kDirections - 1e-9);
  const double s = std::clamp((reynolds - t.reynolds_min) / t.reynolds_step, 0.0, SectionTable::kRows - 1 - 1e-9);
  const int j = static_cast<int>(q), i = static_cast<int>(s);
  const SectionForce *low = t.row(i) + j, *high = t.row(i + 1) + j;
  const double wq = q - j, ws = s - i;
  const auto between = [&](double l0, double l1, double h0, double h1) {
    const double first = l0 + ws * (h0 - l0), second = l1 + ws * (h1 - l1);
    return first + wq * (second - first);
  };
  return {between(low[0].up, low[1].up, high[0].up, high[1].up), between(low[0].drag, low[1].drag, high[0].drag, high[1].drag)};
}

}  // namespace rotorloop::sim
