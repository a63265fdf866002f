// Resistance and dead time from direct currents in six directions, at each along one phase: with current I along the vector its phases
// carry I, -I/2, -I/2, and a leg loses K (1 - a/i), so that
//   V = R I + 4/3 K - 2 K a / I.
// Directions half a turn apart pass the same amplifiers the other way: gains and the drift of zeros drop out of the pairs, and what is left
// between them is the winding's heat, with which R is taken back to the start.
#pragma once
#include <cstdint>

#include "firmware/core/commission/least_squares.hpp"
#include "firmware/core/motor/vector.hpp"

namespace rotorloop::firmware {

constexpr std::uint32_t kDirections = 6, kLevels = 4, kPasses = 2;
// Of the largest current; the least leaves half of it in two phases, beyond the ripple. Largest and least one after the other: a first
// resistance comes from these two, before a zero has drifted.
constexpr float kLevelShare[kLevels] = {0.75f, 1.0f, 0.3f, 0.5f};
constexpr std::uint32_t kLargestLevel = 1, kLeastLevel = 2;

struct DirectFit {
  float largest_A = 1.0f;
  LeastSquares<6> sums{};  // R of the three pairs, R's growth with heat, K, 2 K a; currents over the largest
};

// along_V, along_A: means of a window. heat_A2_s: squared current over time, so far.
inline void add_window(DirectFit& f, std::uint32_t direction, float along_V, float along_A, float heat_A2_s) {
  const float share = along_A / f.largest_A;
  if (!(share > 0.1f)) return;
  std::array<float, 6> x{};
  x[direction % 3] = share;
  x[3] = share * heat_A2_s / (f.largest_A * f.largest_A);
  x[4] = 4.0f / 3.0f;
  x[5] = -0.1f / share;
  f.sums.add(x, along_V);
}

// What is known of the heat before: little. A zero that drifts while a direction is measured looks like heat between opposite directions:
// 0.1 A of it against 2 % of R in a second.
inline void expect_little_heat(DirectFit& f) { f.sums.add({0.0f, 0.0f, 0.0f, 5.0f / f.largest_A, 0.0f, 0.0f}, 0.0f); }

struct DirectResult {
  float resistance_ohm = 0.0f, lost_V = 0.0f, knee_A = 0.0f;
  bool valid = false;
};

inline DirectResult solve(const DirectFit& f) {
  std::array<float, 6> x{};
  if (!f.sums.solve(x)) return {};
  DirectResult r;
  r.resistance_ohm = (x[0] + x[1] + x[2]) / (3.0f * f.largest_A);
  r.lost_V = x[4];
  // 2 K a / I = x5 · 0.1 · largest / I
  r.knee_A = x[4] > 0.0f ? clamp(0.05f * x[5] * f.largest_A / x[4], 0.0f, 0.1f * f.largest_A) : 0.0f;
  r.valid = true;
  return r;
}

struct PassResult {
  DirectResult direct{};
  float inductance_d_H = 0.0f, inductance_q_H = 0.0f;
};

}  // namespace rotorloop::firmware
